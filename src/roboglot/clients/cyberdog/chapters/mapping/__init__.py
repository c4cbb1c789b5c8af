"""Chapters "tasks", "mapping", "navigation", "charging" and "labels": tasks of 6004, stored maps."""
