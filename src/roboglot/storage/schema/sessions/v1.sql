-- Signed-in browsers of a console: `key` is a hash of the cookie, `proof` what was shown, which the cookie alone opens.
CREATE TABLE session (
    key TEXT PRIMARY KEY, name TEXT NOT NULL, proof BLOB NOT NULL, until REAL NOT NULL, robot TEXT NOT NULL,
    code TEXT NOT NULL
) STRICT;
