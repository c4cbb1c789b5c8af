"""Standing square before stairs: seeing the ground, finding the first edge, aligning to it."""
