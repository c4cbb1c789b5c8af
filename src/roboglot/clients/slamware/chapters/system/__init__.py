"""Chapters "system" and "sensors": power, health, devices, network."""
