-- Who changed what, in a file of its own. Who adds rows changes audit_turn before, so that only one adds at a time.
CREATE TABLE IF NOT EXISTS audit (
    number INTEGER PRIMARY KEY, at REAL NOT NULL, who TEXT NOT NULL, address TEXT NOT NULL, robot TEXT NOT NULL,
    door TEXT NOT NULL, operation TEXT NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL,
    repeats INTEGER NOT NULL, hash TEXT NOT NULL
) STRICT;
CREATE TRIGGER IF NOT EXISTS audit_stays BEFORE UPDATE ON audit BEGIN SELECT RAISE(ABORT, 'the audit stays'); END;
CREATE TRIGGER IF NOT EXISTS audit_is_kept BEFORE DELETE ON audit BEGIN SELECT RAISE(ABORT, 'the audit stays'); END;
CREATE TABLE IF NOT EXISTS audit_turn (taken INTEGER NOT NULL) STRICT;
INSERT INTO audit_turn SELECT 0 WHERE NOT EXISTS (SELECT * FROM audit_turn);
