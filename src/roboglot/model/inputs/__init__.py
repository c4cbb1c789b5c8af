"""Inputs from outside: those that are no requests at doors, noted and given again; fairness to clients, and the turns
that other work takes between them."""
