"""Recordings: a robot's exchanges at its doors, its sensor data and its actions in one MCAP file; and their readers.

Knows the model's tap, events and components, and no door.
"""
