"""Inputs of a run that are no requests at doors: what they are, who notes them, how they are given again."""
