"""Chapters "status", "settings", "ota", "bluetooth" and others about the dog's own system."""
