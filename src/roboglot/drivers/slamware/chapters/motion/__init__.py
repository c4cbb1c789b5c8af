"""Chapter "motion": velocities, moves, navigation and docking, all actions of the robot."""
