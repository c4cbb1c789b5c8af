"""Simultaneous localization and mapping: scan matching, evidence grid, loop closing, the two components."""
