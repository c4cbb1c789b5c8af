"""Third-party clients, and the transcripts of the documentation."""
