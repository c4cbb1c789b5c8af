"""The RoboMaster EP's plain-text SDK in front of a robot: TCP control and events, UDP pushes and discovery."""
