"""Sockets in the data folder, by which the machine's owner controls robots and recordings."""
