"""Verbs of pages and scripts, by name: of a robot, its map, the simulated world and its clock."""
