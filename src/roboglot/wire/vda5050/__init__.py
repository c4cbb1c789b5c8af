"""The messages of VDA 5050 2.1 and 3.0 as bytes: what fleet control sends, read and checked. Knows no robot."""
