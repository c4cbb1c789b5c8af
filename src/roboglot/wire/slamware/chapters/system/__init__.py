"""Chapters "system" and "sensors": name plate, power, health, devices, network."""
