"""A real robot behind DJI's plain-text SDK (RoboMaster EP). Knows the client and the model, no door."""
