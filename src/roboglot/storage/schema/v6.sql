-- When a task that waits for its time runs: seconds since 1970 on the robot's clock.
ALTER TABLE program ADD COLUMN due REAL;

-- Which modules a task or a module calls.
CREATE TABLE program_use (
    robot TEXT NOT NULL,
    kind TEXT NOT NULL, -- of the caller: task or module
    id TEXT NOT NULL,   -- of the caller
    module TEXT NOT NULL,
    PRIMARY KEY (robot, kind, id, module)
) WITHOUT ROWID;
CREATE INDEX program_use_of ON program_use (robot, module);
