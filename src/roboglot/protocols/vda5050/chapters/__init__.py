"""What fleet control may ask for, a file per chapter of the standard."""
