"""Commands of `roboglot map` on ROS maps and recorded drives. Knows no robot."""
