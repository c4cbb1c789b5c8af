"""Chapters "status", "settings", "ota", "bluetooth" and the rest: the dog's own system."""
