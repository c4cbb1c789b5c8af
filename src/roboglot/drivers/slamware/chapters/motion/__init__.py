"""Chapter "motion": velocities, moves, navigation, docking: whatever the robot does as one of its actions."""
