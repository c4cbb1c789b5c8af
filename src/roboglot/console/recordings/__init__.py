"""Recordings on pages: the running one, and those that are kept in the data folder."""
