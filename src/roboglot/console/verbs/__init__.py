"""What a page or a script may do, by name: verbs of a robot, its map, the simulated world and its clock."""
