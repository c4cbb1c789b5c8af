"""Driving: by hand, to goals, in lanes; the planner, the route follower and the rules drawn on the map."""
