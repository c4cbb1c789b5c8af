-- An app's package in pieces of up to 1 MB, in order: it is never whole in memory.
CREATE TABLE app_piece (
    robot TEXT NOT NULL,
    name TEXT NOT NULL,
    number INTEGER NOT NULL,
    data BLOB NOT NULL,
    PRIMARY KEY (robot, name, number)
);
INSERT INTO app_piece (robot, name, number, data) SELECT robot, name, 0, package FROM app;
ALTER TABLE app ADD COLUMN size INTEGER NOT NULL DEFAULT 0;
UPDATE app SET size = length(package);
ALTER TABLE app DROP COLUMN package;
