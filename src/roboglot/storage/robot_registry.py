"""Registry of robots: which program claims each of them, with an epoch. Knows no robot and no clock.

A program that holds robots increments its count of renewals. Another program that wants one of them compares the count
with an earlier one, by its own clock, so that no machine's date matters. Each change of a program's robots, and each
renewal, first updates the row with the count, so that only one of them happens at a time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from roboglot.storage.transactions import Connection, Transactions
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim to one robot: its program, and the address of its doors.

    ``gateway``: HOST:PORT for `roboglot connect`, empty: none; ``certificate``: the gateway's SHA-256 fingerprint.
    """

    robot: str
    holder: str
    address: str
    epoch: int
    gateway: str = ""
    certificate: str = ""


class RobotsHeld(Exception):
    """Other programs hold some of the robots: ``claims``; ``renewals``: those programs' counts of renewals."""

    def __init__(self, claims: Mapping[str, Claim], renewals: Mapping[str, int]) -> None:
        super().__init__(", ".join(claims))
        self.claims, self.renewals = claims, renewals


class RobotRegistry:
    """The registry; every call is one transaction."""

    def __init__(self, database: Transactions) -> None:
        self._database = database

    async def take(self, addresses: Mapping[str, str], holder: str, silent: Mapping[str, int]) -> dict[str, int]:
        """Claim all these robots for ``holder``; return their new epochs. Raises RobotsHeld, and then claims none.

        A robot is free if it is new, was released, was this holder's before, or if its holder's count of renewals is
        still the one in ``silent``. Robots that ``holder`` had before and does not want any more are released: its
        renewals would hold them for ever.
        """

        def work(connection: Connection) -> dict[str, int]:
            free = {"", holder, *_locked(connection, silent, holder)}
            taken = {
                robot: epoch
                for robot in sorted(addresses)  # always in this order, to prevent deadlocks between programs
                if (epoch := _take(connection, robot, addresses[robot], holder, free))
            }
            if left := addresses.keys() - taken.keys():
                claims = {robot: claim for robot, claim in _all(connection).items() if robot in left}
                held = {claim.holder for claim in claims.values()}
                raise RobotsHeld(claims, {name: count for name, count in _renewals(connection).items() if name in held})
            kept = connection.execute("SELECT robot FROM robot_home WHERE holder=?", (holder,)).fetchall()
            query = "UPDATE robot_home SET holder='' WHERE robot=?"
            connection.executemany(query, sorted(row for row in kept if row[0] not in addresses))
            return taken

        return await self._database.run(work)

    async def renew(self, holder: str) -> dict[str, int]:
        """Renew all robots of ``holder``; return their epochs."""

        def work(connection: Connection) -> dict[str, int]:
            connection.execute("UPDATE robot_holder SET renewals=renewals+1 WHERE holder=?", (holder,))
            query = "SELECT robot, epoch FROM robot_home WHERE holder=?"
            return dict(connection.execute(query, (holder,)))

        return await self._database.run(work)

    async def renewals(self) -> dict[str, int]:
        """Return the count of renewals of each program."""
        return await self._database.read(_renewals)

    async def announce(self, holder: str, gateway: str, certificate: str) -> None:
        """Store the gateway of ``holder``'s robots."""
        query = "UPDATE robot_home SET gateway=?, certificate=? WHERE holder=?"
        values = (gateway, certificate, holder)
        await self._database.run(lambda connection: connection.execute(query, values).rowcount)

    async def of(self, robot: str) -> Claim | None:
        """Return the last claim to a robot; None if there never was one."""
        claims = await self._database.read(lambda connection: _rows(connection, "WHERE robot=?", (robot,)))
        return claims.get(robot)

    async def release(self, holder: str, epochs: Mapping[str, int]) -> None:
        """Release these robots, except those with a later epoch."""
        query = "UPDATE robot_home SET holder='' WHERE holder=? AND robot=? AND epoch=?"
        rows = [(holder, robot, epochs[robot]) for robot in sorted(epochs)]
        await self._database.run(lambda connection: connection.executemany(query, rows))

    async def free(self, silent: Mapping[str, int], robots: Collection[str]) -> list[str]:
        """Release and return those robots whose holder's count of renewals is still the one in ``silent``."""

        def work(connection: Connection) -> list[str]:
            held = [
                (robot, holder)
                for holder in _locked(connection, silent)
                for (robot,) in connection.execute("SELECT robot FROM robot_home WHERE holder=?", (holder,)).fetchall()
                if robot in robots
            ]
            query = "UPDATE robot_home SET holder='' WHERE robot=? AND holder=?"
            return [row[0] for row in sorted(held) if connection.execute(query, row).rowcount == 1]

        return await self._database.run(work)

    async def take_back(self, epochs: Mapping[str, int], holder: str) -> dict[str, int]:
        """Return freed robots to ``holder`` unless another program had them since; return their new epochs."""
        query = "UPDATE robot_home SET holder=?, epoch=epoch+1 WHERE robot=? AND holder='' AND epoch=?"

        def work(connection: Connection) -> dict[str, int]:
            return {
                robot: epochs[robot] + 1
                for robot in sorted(epochs)
                if connection.execute(query, (holder, robot, epochs[robot])).rowcount == 1
            }

        return await self._database.run(work)

    async def all(self) -> dict[str, Claim]:
        """Return the last claim to every robot, by its name."""
        return await self._database.read(_all)


def _locked(connection: Connection, silent: Mapping[str, int], holder: str = "") -> list[str]:
    """Return the programs in ``silent`` with unchanged counts, and keep them from renewing until the transaction ends.

    ``holder``: a program that takes robots, which counts as a sign of life.
    """
    still = []
    for name in sorted({holder, *silent} - {""}):  # always in this order, to prevent deadlocks between programs
        if name == holder:
            query = "INSERT INTO robot_holder (holder, renewals) VALUES (?, 1)"
            changed = " ON CONFLICT (holder) DO UPDATE SET renewals=robot_holder.renewals+1"
            connection.execute(query + changed, (holder,))
            continue
        query = "UPDATE robot_holder SET renewals=renewals WHERE holder=? AND renewals=?"
        if connection.execute(query, (name, silent[name])).rowcount == 1:
            still.append(name)
    return still


def _take(connection: Connection, robot: str, address: str, holder: str, free: Collection[str]) -> int:
    """Return the new epoch; 0 if another holder than those in ``free`` has it."""
    marks = ", ".join("?" * len(free))
    taken = connection.execute(
        "UPDATE robot_home SET holder=?, address=?, epoch=epoch+1, gateway='', certificate=''"
        f" WHERE robot=? AND holder IN ({marks})",
        (holder, address, robot, *sorted(free)),
    )
    if taken.rowcount != 1:
        added = connection.execute(
            "INSERT INTO robot_home (robot, holder, address, epoch) VALUES (?, ?, ?, 1) ON CONFLICT (robot) DO NOTHING",
            (robot, holder, address),
        )
        return 1 if added.rowcount == 1 else 0
    return int(connection.execute("SELECT epoch FROM robot_home WHERE robot=?", (robot,)).fetchone()[0])


def _renewals(connection: Connection) -> dict[str, int]:
    return dict(connection.execute("SELECT holder, renewals FROM robot_holder"))


def _all(connection: Connection) -> dict[str, Claim]:
    return _rows(connection, "ORDER BY robot")


def _rows(connection: Connection, which: str, values: Sequence[str] = ()) -> dict[str, Claim]:
    columns = "robot, holder, address, epoch, gateway, certificate"
    rows = connection.execute(f"SELECT {columns} FROM robot_home {which}", values)
    return {row[0]: Claim(*row) for row in rows}
