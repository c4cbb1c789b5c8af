"""People in the world: their routines, walks and postures."""
