"""Robots among robots: what moves around, who goes first, and where to let others pass."""
