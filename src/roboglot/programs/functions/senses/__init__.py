"""What programs call to learn about dog and surroundings: sensors, gestures, people, touch."""
