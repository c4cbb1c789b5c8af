"""Pictures, films, faces."""
