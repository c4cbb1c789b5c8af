"""Frames and messages on the wire, by the same groups of chapters as ``protocols.cyberdog.chapters``."""
