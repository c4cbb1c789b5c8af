"""Floors of a building: riding the lift, and one stored map, dock and set of annotations per floor."""
