"""Chapters "audio" and "following": the loudspeaker, and following a person or the bracelet."""
