"""Chapter "statistics": metres and seconds over the robot's life."""
