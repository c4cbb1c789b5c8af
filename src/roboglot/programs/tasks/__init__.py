"""Tasks: states, schedule, runs and records, according to the manual's table."""
