"""Chapters "photo and video" and "image transmission": pictures, recordings, live video."""
