-- What the reference cloud keeps (roboglot cloud), as in SQLite's v7. Ids compare byte by byte, whatever the locale.
CREATE TABLE cloud_account (
    name TEXT COLLATE "C" PRIMARY KEY,
    token_hash TEXT NOT NULL UNIQUE
);
CREATE TABLE cloud_program (
    account TEXT COLLATE "C" NOT NULL REFERENCES cloud_account (name) ON DELETE CASCADE,
    kind TEXT NOT NULL, -- task or module
    id TEXT COLLATE "C" NOT NULL,
    document TEXT NOT NULL, -- the frame that saved it
    favourite INTEGER NOT NULL DEFAULT 0,
    PRIMARY KEY (account, kind, id)
);
CREATE TABLE cloud_record (
    seq BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    account TEXT COLLATE "C" NOT NULL REFERENCES cloud_account (name) ON DELETE CASCADE,
    robot TEXT NOT NULL,
    document TEXT NOT NULL
);
CREATE INDEX cloud_record_of ON cloud_record (account, seq);
