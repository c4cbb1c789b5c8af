"""The operations of the Slamware REST API, one file or package per chapter of the manual."""
