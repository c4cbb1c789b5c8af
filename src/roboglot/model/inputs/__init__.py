"""Inputs from outside: those that are no requests at doors, noted and given again; the turns of clients."""
