"""Clients of others, and the transcripts of the documentation."""
