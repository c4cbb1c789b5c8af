"""One robot, every protocol: a robot runtime that speaks four vendors' protocols at once."""
