"""Texts of errors when reading or writing files."""

from __future__ import annotations


def in_words(error: BaseException) -> str:
    """Return an error's text, with the file's name and without the error's number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)
