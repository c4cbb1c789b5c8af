"""Simulated cargo boxes, jack, and the radios of lift and traffic."""
