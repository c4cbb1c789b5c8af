"""One robot, every protocol: a robot runtime that speaks the protocols of Slamtec, DJI and Xiaomi at once."""
