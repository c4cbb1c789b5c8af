"""Recorded drives: what a lidar and odometry said, read from the formats that robots and research leave behind."""
