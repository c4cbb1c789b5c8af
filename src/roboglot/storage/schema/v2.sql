-- Programs of the visual protocol; tasks and modules are separate name spaces.
CREATE TABLE program (
    robot TEXT NOT NULL,
    kind TEXT NOT NULL, -- task or module
    id TEXT NOT NULL,
    describe TEXT NOT NULL,
    style TEXT NOT NULL, -- opaque: what the editor rebuilds its blocks from
    mode TEXT NOT NULL,
    condition TEXT NOT NULL,
    body TEXT NOT NULL,
    state TEXT NOT NULL,
    PRIMARY KEY (robot, kind, id)
);

-- What programs printed and what became of them; bounded per program by whoever writes.
CREATE TABLE program_log (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    robot TEXT NOT NULL,
    kind TEXT NOT NULL,
    id TEXT NOT NULL,
    at REAL NOT NULL, -- seconds since 1970, on the robot's clock
    level TEXT NOT NULL, -- print, call, note or error
    text TEXT NOT NULL
);
CREATE INDEX program_log_of ON program_log (robot, kind, id, seq);
