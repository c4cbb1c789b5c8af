"""Chapters "members", "faces", "following" and "audio": people known, seen, followed and heard by the dog."""
