"""Chapters "system" and "sensors": health, power, devices, lights, network, laser scan."""
