"""Crash-safe storage: an SQLite file with places, maps, programs and settings."""
