"""Inputs from outside, other than requests at doors, recorded and repeated; fairness between clients and robots."""
