"""What a robot learns of its own odometry: how far it may be wrong, and what it gets wrong all the time."""
