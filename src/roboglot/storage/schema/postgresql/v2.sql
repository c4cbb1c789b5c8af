-- What robots keep, as in SQLite's v1 to v12. Ids compare byte by byte, whatever the locale.
CREATE TABLE place (
    seq BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    robot TEXT COLLATE "C" NOT NULL,
    id TEXT COLLATE "C" NOT NULL,
    x DOUBLE PRECISION NOT NULL,
    y DOUBLE PRECISION NOT NULL,
    yaw DOUBLE PRECISION NOT NULL,
    metadata TEXT NOT NULL, -- JSON object of strings
    UNIQUE (robot, id)
);
CREATE TABLE map (
    seq BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    robot TEXT COLLATE "C" NOT NULL,
    name TEXT COLLATE "C" NOT NULL,
    width INTEGER NOT NULL,
    height INTEGER NOT NULL,
    resolution DOUBLE PRECISION NOT NULL,
    origin_x DOUBLE PRECISION NOT NULL,
    origin_y DOUBLE PRECISION NOT NULL,
    grid BYTEA NOT NULL, -- int8 log-odds, row 0 = smallest y, zlib
    labels TEXT NOT NULL, -- JSON
    saved_at DOUBLE PRECISION NOT NULL,
    outdoor INTEGER NOT NULL DEFAULT 0,
    number TEXT NOT NULL DEFAULT '0', -- up to 64 bits without a sign; 0: none was given
    anchor TEXT, -- JSON: where on the globe the map lies
    dock TEXT, -- JSON: x, y in m, yaw in rad; NULL: none was known
    UNIQUE (robot, name)
);
CREATE TABLE setting (
    robot TEXT COLLATE "C" NOT NULL,
    key TEXT COLLATE "C" NOT NULL,
    value TEXT NOT NULL, -- JSON
    PRIMARY KEY (robot, key)
);
CREATE TABLE annotations (
    robot TEXT COLLATE "C" PRIMARY KEY,
    body TEXT NOT NULL -- JSON
);
CREATE TABLE file (
    robot TEXT COLLATE "C" NOT NULL,
    name TEXT COLLATE "C" NOT NULL,
    data BYTEA NOT NULL,
    saved_at DOUBLE PRECISION NOT NULL, -- seconds since 1970
    PRIMARY KEY (robot, name)
);
CREATE TABLE member (
    id BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    robot TEXT COLLATE "C" NOT NULL,
    name TEXT COLLATE "C" NOT NULL,
    host INTEGER NOT NULL,
    face BYTEA,
    voice BYTEA,
    UNIQUE (robot, name)
);
CREATE TABLE app (
    robot TEXT COLLATE "C" NOT NULL,
    name TEXT COLLATE "C" NOT NULL,
    version TEXT NOT NULL,
    installed_at DOUBLE PRECISION NOT NULL, -- seconds since 1970
    size INTEGER NOT NULL,
    PRIMARY KEY (robot, name)
);
CREATE TABLE app_piece (
    robot TEXT COLLATE "C" NOT NULL,
    name TEXT COLLATE "C" NOT NULL,
    number INTEGER NOT NULL,
    data BYTEA NOT NULL,
    PRIMARY KEY (robot, name, number)
);
CREATE TABLE ledger (
    seq BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    robot TEXT COLLATE "C" NOT NULL,
    kind TEXT COLLATE "C" NOT NULL,
    id TEXT COLLATE "C" NOT NULL,
    document TEXT NOT NULL, -- JSON
    UNIQUE (robot, kind, id)
);
CREATE TABLE program (
    robot TEXT COLLATE "C" NOT NULL,
    kind TEXT NOT NULL, -- task or module
    id TEXT COLLATE "C" NOT NULL,
    describe TEXT NOT NULL,
    style TEXT NOT NULL, -- opaque: what the editor rebuilds its blocks from
    mode TEXT NOT NULL,
    condition TEXT NOT NULL,
    body TEXT NOT NULL,
    state TEXT NOT NULL,
    due DOUBLE PRECISION, -- when a task that waits runs: seconds since 1970 on the robot's clock
    owner TEXT NOT NULL DEFAULT '', -- who ran or wrote it last, as [access] knows them
    PRIMARY KEY (robot, kind, id)
);
CREATE TABLE program_log (
    seq BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    robot TEXT COLLATE "C" NOT NULL,
    kind TEXT NOT NULL,
    id TEXT COLLATE "C" NOT NULL,
    at DOUBLE PRECISION NOT NULL, -- seconds since 1970, on the robot's clock
    level TEXT NOT NULL, -- print, call, note or error
    text TEXT NOT NULL
);
CREATE INDEX program_log_of ON program_log (robot, kind, id, seq);
CREATE TABLE program_use (
    robot TEXT COLLATE "C" NOT NULL,
    kind TEXT NOT NULL, -- of the caller: task or module
    id TEXT COLLATE "C" NOT NULL, -- of the caller
    module TEXT COLLATE "C" NOT NULL,
    PRIMARY KEY (robot, kind, id, module)
);
CREATE INDEX program_use_of ON program_use (robot, module);
CREATE TABLE program_run (
    robot TEXT COLLATE "C" NOT NULL,
    id TEXT COLLATE "C" NOT NULL,
    header TEXT NOT NULL, -- JSON
    PRIMARY KEY (robot, id)
);
CREATE TABLE program_call (
    robot TEXT COLLATE "C" NOT NULL,
    id TEXT COLLATE "C" NOT NULL,
    seq INTEGER NOT NULL,
    name TEXT NOT NULL,
    answer BYTEA, -- NULL: it was under way
    PRIMARY KEY (robot, id, seq)
);
CREATE TABLE cloud_outbox (
    seq BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    robot TEXT COLLATE "C" NOT NULL,
    document TEXT NOT NULL
);
CREATE INDEX cloud_outbox_of ON cloud_outbox (robot, seq);
