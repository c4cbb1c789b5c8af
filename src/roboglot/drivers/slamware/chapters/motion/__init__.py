"""Chapter "motion": velocities, moves, navigation, docking: what the robot does as actions."""
