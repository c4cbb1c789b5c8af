"""Slamware REST 1.1.0 on the wire, for both ends: JSON schemas and binary maps, one file per chapter.

Knows no socket, no path and no robot. Lengths are metres, angles radians counter-clockwise, as in the model.
"""
