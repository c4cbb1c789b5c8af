"""Floors, stairs, lifts, shelves and start places."""
