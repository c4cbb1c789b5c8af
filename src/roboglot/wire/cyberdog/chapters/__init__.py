"""Frames and messages on the wire, grouped by chapter as in ``protocols.cyberdog.chapters``."""
