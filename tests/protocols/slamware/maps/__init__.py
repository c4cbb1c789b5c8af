"""Chapters "slam", "artifact" and "multi-floor": maps and what is drawn on them."""
