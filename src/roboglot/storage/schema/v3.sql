-- Walls, tracks, areas, docks and landmarks of one robot's map, as JSON.
CREATE TABLE annotations (
    robot TEXT PRIMARY KEY,
    body TEXT NOT NULL
) WITHOUT ROWID;

-- Files that clients left with a robot, byte for byte.
CREATE TABLE file (
    robot TEXT NOT NULL,
    name TEXT NOT NULL,
    data BLOB NOT NULL,
    saved_at REAL NOT NULL, -- seconds since 1970
    PRIMARY KEY (robot, name)
);
