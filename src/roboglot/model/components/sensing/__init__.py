"""Interfaces of sensors: lidar, IMU, odometry, cameras, touch and distance sensors."""
