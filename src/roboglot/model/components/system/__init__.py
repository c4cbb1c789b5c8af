"""Interfaces of the robot's own system: network, firmware, health, settings, storage, control lease."""
