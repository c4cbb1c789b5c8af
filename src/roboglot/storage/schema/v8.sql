-- Runs of programs that are under way: what they were started with, and how each of their calls was answered.
CREATE TABLE program_run (
    robot TEXT NOT NULL,
    id TEXT NOT NULL,
    header TEXT NOT NULL, -- JSON
    PRIMARY KEY (robot, id)
) WITHOUT ROWID;
CREATE TABLE program_call (
    robot TEXT NOT NULL,
    id TEXT NOT NULL,
    seq INTEGER NOT NULL,
    name TEXT NOT NULL,
    answer BLOB, -- none: it was under way
    PRIMARY KEY (robot, id, seq)
) WITHOUT ROWID;
