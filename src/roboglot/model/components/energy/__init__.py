"""Interfaces of battery, charging and power modes."""
