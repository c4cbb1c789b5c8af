-- What a robot still has to tell its cloud, in order.
CREATE TABLE cloud_outbox (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    robot TEXT NOT NULL,
    document TEXT NOT NULL
);
CREATE INDEX cloud_outbox_of ON cloud_outbox (robot, seq);

-- The cloud's own side (roboglot cloud): who may come in, what robots saved, what happened.
CREATE TABLE cloud_account (
    name TEXT PRIMARY KEY,
    token_hash TEXT NOT NULL UNIQUE
) WITHOUT ROWID;
CREATE TABLE cloud_program (
    account TEXT NOT NULL REFERENCES cloud_account (name) ON DELETE CASCADE,
    kind TEXT NOT NULL, -- task or module
    id TEXT NOT NULL,
    document TEXT NOT NULL, -- the frame that saved it
    favourite INTEGER NOT NULL DEFAULT 0,
    PRIMARY KEY (account, kind, id)
) WITHOUT ROWID;
CREATE TABLE cloud_record (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    account TEXT NOT NULL REFERENCES cloud_account (name) ON DELETE CASCADE,
    robot TEXT NOT NULL,
    document TEXT NOT NULL
);
CREATE INDEX cloud_record_of ON cloud_record (account, seq);
