"""The building and its things: walls, lifts, docks, shelves, tags, movable objects. Knows no robot's components."""
