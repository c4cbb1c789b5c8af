"""Learning of a robot's odometry: its noise, and its systematic errors."""
