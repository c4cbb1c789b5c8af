"""Runs: the worker, its limits, what survives."""
