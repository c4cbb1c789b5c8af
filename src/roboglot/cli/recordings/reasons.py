"""Words for why a file cannot be read or written."""

from __future__ import annotations


def in_words(error: BaseException) -> str:
    """Return what went wrong, with the file that the system names and without its number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)
