-- Points of interest; seq keeps the order in which people added them.
CREATE TABLE place (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    robot TEXT NOT NULL,
    id TEXT NOT NULL,
    x REAL NOT NULL,
    y REAL NOT NULL,
    yaw REAL NOT NULL,
    metadata TEXT NOT NULL, -- JSON object of strings
    UNIQUE (robot, id)
);

-- Saved maps; grid is int8 log-odds, row 0 = smallest y, zlib.
CREATE TABLE map (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    robot TEXT NOT NULL,
    name TEXT NOT NULL,
    width INTEGER NOT NULL,
    height INTEGER NOT NULL,
    resolution REAL NOT NULL,
    origin_x REAL NOT NULL,
    origin_y REAL NOT NULL,
    grid BLOB NOT NULL,
    labels TEXT NOT NULL, -- JSON
    saved_at REAL NOT NULL,
    UNIQUE (robot, name)
);

-- One value per key and robot, as JSON.
CREATE TABLE setting (
    robot TEXT NOT NULL,
    key TEXT NOT NULL,
    value TEXT NOT NULL,
    PRIMARY KEY (robot, key)
) WITHOUT ROWID;
