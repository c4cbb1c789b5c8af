"""Tools for processes that host robots: a heap that gives back, open files, an end in any case."""
