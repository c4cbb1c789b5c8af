"""Docking at charging docks and at marks, and carrying shelves."""
