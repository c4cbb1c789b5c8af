"""Tools for processes that host robots: heap settings, limit of open files, a guaranteed end."""
