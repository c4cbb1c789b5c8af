"""Requests of fleet control, one file per chapter of the standard."""
