"""Recorded drives: lidar scans and odometry, read from the formats of robots and research."""
