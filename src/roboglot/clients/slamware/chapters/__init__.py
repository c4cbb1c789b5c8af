"""Typed methods for the operations of the Slamware REST API, by chapter as in ``protocols.slamware.chapters``."""
