"""Chapters "tasks", "mapping", "navigation", "labels" and "charging": algorithm tasks of 6004 and the map."""
