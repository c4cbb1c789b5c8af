"""What a process needs that hosts robots: a heap that gives back, open files, an end in any case."""
