"""Loss of the pose in the map, and its recovery."""
