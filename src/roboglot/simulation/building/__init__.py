"""The building and its things: walls, lifts, docks, shelves, tags, objects that move. Knows no robot's components."""
