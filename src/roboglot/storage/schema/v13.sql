-- Which program runs which robot. A later epoch ends every earlier one; renewals tell a program that lives from a row.
CREATE TABLE robot_home (
    robot TEXT PRIMARY KEY,
    holder TEXT NOT NULL, -- empty: released
    address TEXT NOT NULL,
    epoch INTEGER NOT NULL,
    renewals INTEGER NOT NULL
);
CREATE INDEX robot_home_of ON robot_home (holder);
