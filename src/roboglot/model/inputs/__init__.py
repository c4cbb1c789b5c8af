"""Inputs from outside other than requests at doors, recorded and repeated; and fairness between clients and other work."""
