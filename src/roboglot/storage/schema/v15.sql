-- How often a program has renewed its robots: one row, however many robots it has.
CREATE TABLE robot_holder (
    holder TEXT PRIMARY KEY,
    renewals INTEGER NOT NULL
);
INSERT INTO robot_holder (holder, renewals) SELECT DISTINCT holder, 0 FROM robot_home WHERE holder <> '';
-- A program of an older version, which still counts here, stops its robots.
ALTER TABLE robot_home DROP COLUMN renewals;
