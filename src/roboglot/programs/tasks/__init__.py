"""Tasks: their states, schedule, runs and records, as the manual's table allows."""
