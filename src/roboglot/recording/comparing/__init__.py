"""Compares what two robots answered and pushed: value by value, under a mask."""
