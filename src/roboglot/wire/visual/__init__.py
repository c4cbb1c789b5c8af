"""Frames of the visual programming protocol: JSON texts, their checks and codes. No sockets, no robot, no programs."""
