"""Detectors for a camera's picture, computed from the world's geometry: one function per kind of thing.

They find things in the picture that are near and large enough, face the camera and are not hidden; with some noise.
"""
