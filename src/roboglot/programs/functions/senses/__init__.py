"""Functions that sense dog and surroundings: sensors, gestures, people, touch."""
