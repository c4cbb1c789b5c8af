"""Chapters "low power" and "electronic skin": power and skin of the dog."""
