"""Simulated sensors. Each reads the world's truth and adds its own range, noise and rate."""
