"""Robots as tools for agents, by the Model Context Protocol. A client of the console's interface like any script."""
