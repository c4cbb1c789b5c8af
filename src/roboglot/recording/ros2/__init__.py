"""Recorded messages as ROS 2 messages, and recordings as ROS 2 bags. Importing it needs the extra ``ros2``."""
