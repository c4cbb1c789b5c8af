-- Who may do what, in a file of its own: `roboglot access` changes it beside the running robots.
CREATE TABLE IF NOT EXISTS identity (
    name TEXT PRIMARY KEY, kind TEXT NOT NULL, password TEXT NOT NULL DEFAULT '', token TEXT UNIQUE
) STRICT;
CREATE TABLE IF NOT EXISTS allowed (
    identity TEXT NOT NULL REFERENCES identity (name) ON DELETE CASCADE,
    robot TEXT NOT NULL, rights TEXT NOT NULL, until REAL, PRIMARY KEY (identity, robot)
) STRICT;
-- Counted up by every change, from any program: running robots look at it.
CREATE TABLE IF NOT EXISTS access_version (number INTEGER NOT NULL) STRICT;
INSERT INTO access_version SELECT 1 WHERE NOT EXISTS (SELECT * FROM access_version);
CREATE TRIGGER IF NOT EXISTS identity_added AFTER INSERT ON identity BEGIN UPDATE access_version SET number = number + 1; END;
CREATE TRIGGER IF NOT EXISTS identity_changed AFTER UPDATE ON identity BEGIN UPDATE access_version SET number = number + 1; END;
CREATE TRIGGER IF NOT EXISTS identity_removed AFTER DELETE ON identity BEGIN UPDATE access_version SET number = number + 1; END;
CREATE TRIGGER IF NOT EXISTS allowed_added AFTER INSERT ON allowed BEGIN UPDATE access_version SET number = number + 1; END;
CREATE TRIGGER IF NOT EXISTS allowed_changed AFTER UPDATE ON allowed BEGIN UPDATE access_version SET number = number + 1; END;
CREATE TRIGGER IF NOT EXISTS allowed_removed AFTER DELETE ON allowed BEGIN UPDATE access_version SET number = number + 1; END;
