"""The vendors' bytes, parsed and formatted for both ends. Knows no socket and no robot."""
