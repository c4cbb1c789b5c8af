"""Simulated parts."""
