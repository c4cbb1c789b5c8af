"""Sound in the world: how it fades with distance and walls, and voices for texts."""
