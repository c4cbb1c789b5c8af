"""Recordings: what went over a robot's doors and what the robot saw and did, in one MCAP file; and what reads them.

Knows the tap, events and components of the model, and no door.
"""
