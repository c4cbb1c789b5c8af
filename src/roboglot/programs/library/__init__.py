"""The modules of one robot, and checking programs before they are saved."""
