"""Simulated battery, charging contacts and power modes."""
