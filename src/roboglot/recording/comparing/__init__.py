"""Compares the answers and pushes of two robots, value by value, under a mask."""
