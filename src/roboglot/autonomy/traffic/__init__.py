"""Robots among robots: moving things around, right of way, and places to let others pass."""
