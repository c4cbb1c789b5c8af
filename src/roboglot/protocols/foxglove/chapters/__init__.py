"""Handlers, by topic."""
