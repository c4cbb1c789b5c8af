"""Detectors in a camera's picture, computed from the world's geometry: one function for each kind of thing.

They find what is in the picture, near and large enough, turned the right way and not hidden; and not quite exactly.
"""
