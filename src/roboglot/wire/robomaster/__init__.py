"""The RoboMaster EP's plain-text SDK as bytes: lines, commands, replies, pushes. Knows no socket and no robot."""
