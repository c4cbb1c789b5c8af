"""Chapters "members", "faces", "following" and "audio": who the dog knows, sees and hears."""
