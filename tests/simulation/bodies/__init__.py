"""Bodies: legs, motions, hulls."""
