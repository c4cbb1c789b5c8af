"""What `roboglot map` does with ROS maps and recorded drives. Knows no robot."""
