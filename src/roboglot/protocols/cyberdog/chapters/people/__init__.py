"""Chapters "members", "faces", "following" and "audio": people whom the dog knows, sees and hears."""
