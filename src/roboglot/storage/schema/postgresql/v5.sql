-- Who may do what, and who changed what, as in the files access.db and audit.db; of all programs on this database.
CREATE TABLE identity (
    name TEXT COLLATE "C" PRIMARY KEY,
    kind TEXT NOT NULL,
    password TEXT NOT NULL DEFAULT '',
    token TEXT UNIQUE
);
CREATE TABLE allowed (
    identity TEXT COLLATE "C" NOT NULL REFERENCES identity (name) ON DELETE CASCADE,
    robot TEXT COLLATE "C" NOT NULL,
    rights TEXT NOT NULL,
    until DOUBLE PRECISION, -- seconds since 1970; NULL: for good
    PRIMARY KEY (identity, robot)
);
-- Counted up by every change, from any program: running robots look at it.
CREATE TABLE access_version (number BIGINT NOT NULL);
INSERT INTO access_version (number) VALUES (1);
CREATE FUNCTION count_access_change() RETURNS TRIGGER LANGUAGE plpgsql AS
    $$ BEGIN UPDATE access_version SET number = number + 1; RETURN NULL; END $$;
CREATE TRIGGER identity_changed AFTER INSERT OR UPDATE OR DELETE OR TRUNCATE ON identity
    FOR EACH STATEMENT EXECUTE FUNCTION count_access_change();
CREATE TRIGGER allowed_changed AFTER INSERT OR UPDATE OR DELETE OR TRUNCATE ON allowed
    FOR EACH STATEMENT EXECUTE FUNCTION count_access_change();
CREATE TABLE audit (
    number BIGINT PRIMARY KEY,
    at DOUBLE PRECISION NOT NULL, -- seconds since 1970
    who TEXT NOT NULL,
    address TEXT NOT NULL,
    robot TEXT COLLATE "C" NOT NULL,
    door TEXT NOT NULL,
    operation TEXT NOT NULL,
    outcome TEXT NOT NULL,
    reason TEXT NOT NULL,
    repeats BIGINT NOT NULL,
    hash TEXT NOT NULL
);
CREATE FUNCTION refuse_audit_change() RETURNS TRIGGER LANGUAGE plpgsql AS
    $$ BEGIN RAISE EXCEPTION 'the audit stays'; END $$;
CREATE TRIGGER audit_stays BEFORE UPDATE OR DELETE OR TRUNCATE ON audit
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_audit_change();
-- Who adds rows changes this row before, so that only one program adds at a time.
CREATE TABLE audit_turn (taken INTEGER NOT NULL);
INSERT INTO audit_turn (taken) VALUES (0);
