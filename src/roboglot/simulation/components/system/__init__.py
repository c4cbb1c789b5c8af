"""Simulated system parts: network, Bluetooth, disk, firmware, health, logs."""
