"""Schemas and formats by the same chapters of the manual as ``protocols.slamware.chapters``."""
