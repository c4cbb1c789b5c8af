"""Components of the model over a real robot, which is reached by a client of its own protocol.

Units and frames are translated once, here; what the robot does not have is not added.
"""
