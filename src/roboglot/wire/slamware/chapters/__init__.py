"""Schemas and formats, by chapter of the manual as in ``protocols.slamware.chapters``."""
