"""Messages of VDA 5050 2.1 and 3.0 from fleet control, parsed and checked. Knows no robot."""
