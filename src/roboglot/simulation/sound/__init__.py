"""Sound in the world: propagation, and voices for texts."""
