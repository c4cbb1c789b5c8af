-- The people whom the robot knows; face and voice are a recogniser's prints, NULL: not entered.
CREATE TABLE member (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    robot TEXT NOT NULL,
    name TEXT NOT NULL,
    host INTEGER NOT NULL,
    face BLOB,
    voice BLOB,
    UNIQUE (robot, name)
);

-- Apps that people installed.
CREATE TABLE app (
    robot TEXT NOT NULL,
    name TEXT NOT NULL,
    version TEXT NOT NULL,
    package BLOB NOT NULL,
    installed_at REAL NOT NULL, -- seconds since 1970
    PRIMARY KEY (robot, name)
);
