"""Registry of robots' homes: which program runs which robot, under which epoch. Knows no robot and no clock.

A program that has a robot counts its renewals up. Who wants the robot compares the row with one seen earlier, by a
clock of its own: no machine's date matters.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from roboglot.storage.transactions import Connection, Transactions


@dataclass(frozen=True, slots=True)
class Home:
    """One robot's home: its program, the address of its doors, and how often the program renewed it.

    ``gateway``: HOST:PORT where `roboglot connect` reaches it, empty: nowhere; ``certificate``: its SHA-256 there.
    """

    robot: str
    holder: str
    address: str
    epoch: int
    renewals: int
    gateway: str = ""
    certificate: str = ""


class Occupied(Exception):
    """Another program has one of the robots; ``homes`` are those it has."""

    def __init__(self, homes: Mapping[str, Home]) -> None:
        super().__init__(", ".join(homes))
        self.homes = homes


class Homes:
    """Every call is one transaction."""

    def __init__(self, database: Transactions) -> None:
        self._database = database

    async def take(self, addresses: Mapping[str, str], holder: str, silent: Mapping[str, Home]) -> dict[str, int]:
        """Give all these robots to ``holder``, each with a new epoch, which is returned. Raises Occupied for none.

        A robot is free that is new, was released, was this holder's before, or is still as it is in ``silent``.
        """

        def work(connection: Connection) -> dict[str, int]:
            taken = {
                robot: epoch
                for robot in sorted(addresses)  # always in this order, or two programs could wait for each other
                if (epoch := _take(connection, robot, addresses[robot], holder, silent.get(robot)))
            }
            if left := addresses.keys() - taken.keys():
                raise Occupied({robot: home for robot, home in _all(connection).items() if robot in left})
            return taken

        return await self._database.run(work)

    async def renew(self, holder: str) -> dict[str, int]:
        """Renew all that ``holder`` has; return the epochs of these robots."""

        def work(connection: Connection) -> dict[str, int]:
            connection.execute("UPDATE robot_home SET renewals=renewals+1 WHERE holder=?", (holder,))
            query = "SELECT robot, epoch FROM robot_home WHERE holder=?"
            return dict(connection.execute(query, (holder,)))

        return await self._database.run(work)

    async def announce(self, holder: str, gateway: str, certificate: str) -> None:
        """Say where clients reach the robots that ``holder`` has."""
        query = "UPDATE robot_home SET gateway=?, certificate=? WHERE holder=?"
        values = (gateway, certificate, holder)
        await self._database.run(lambda connection: connection.execute(query, values).rowcount)

    async def of(self, robot: str) -> Home | None:
        """Return a robot's last home, if it ever had one."""
        homes = await self._database.read(lambda connection: _rows(connection, "WHERE robot=?", (robot,)))
        return homes.get(robot)

    async def release(self, holder: str, epochs: Mapping[str, int]) -> None:
        """Let others have these robots at once, except those that have a later epoch."""
        query = "UPDATE robot_home SET holder='' WHERE holder=? AND robot=? AND epoch=?"
        rows = [(holder, robot, epochs[robot]) for robot in sorted(epochs)]
        await self._database.run(lambda connection: connection.executemany(query, rows))

    async def free(self, silent: Collection[Home]) -> list[str]:
        """Release those homes that are still exactly so; return their robots."""
        query = "UPDATE robot_home SET holder='' WHERE robot=? AND holder=? AND epoch=? AND renewals=?"

        def work(connection: Connection) -> list[str]:
            return [
                home.robot
                for home in sorted(silent, key=lambda home: home.robot)
                if connection.execute(query, (home.robot, home.holder, home.epoch, home.renewals)).rowcount == 1
            ]

        return await self._database.run(work)

    async def take_back(self, epochs: Mapping[str, int], holder: str) -> dict[str, int]:
        """Give ``holder`` those robots again that were freed and that no other had since; return their new epochs."""
        query = "UPDATE robot_home SET holder=?, epoch=epoch+1, renewals=0 WHERE robot=? AND holder='' AND epoch=?"

        def work(connection: Connection) -> dict[str, int]:
            return {
                robot: epochs[robot] + 1
                for robot in sorted(epochs)
                if connection.execute(query, (holder, robot, epochs[robot])).rowcount == 1
            }

        return await self._database.run(work)

    async def all(self) -> dict[str, Home]:
        """Return every robot's last home by name."""
        return await self._database.read(_all)


def _take(connection: Connection, robot: str, address: str, holder: str, silent: Home | None) -> int:
    """Return the new epoch; 0 if another has it."""
    epoch, renewals = (silent.epoch, silent.renewals) if silent else (-1, -1)
    taken = connection.execute(
        "UPDATE robot_home SET holder=?, address=?, epoch=epoch+1, renewals=0, gateway='', certificate=''"
        " WHERE robot=? AND (holder='' OR holder=? OR (epoch=? AND renewals=?))",
        (holder, address, robot, holder, epoch, renewals),
    )
    if taken.rowcount != 1:
        added = connection.execute(
            "INSERT INTO robot_home (robot, holder, address, epoch, renewals) VALUES (?, ?, ?, 1, 0)"
            " ON CONFLICT (robot) DO NOTHING",
            (robot, holder, address),
        )
        return 1 if added.rowcount == 1 else 0
    return int(connection.execute("SELECT epoch FROM robot_home WHERE robot=?", (robot,)).fetchone()[0])


def _all(connection: Connection) -> dict[str, Home]:
    return _rows(connection, "ORDER BY robot")


def _rows(connection: Connection, which: str, values: Sequence[str] = ()) -> dict[str, Home]:
    columns = "robot, holder, address, epoch, renewals, gateway, certificate"
    rows = connection.execute(f"SELECT {columns} FROM robot_home {which}", values)
    return {row[0]: Home(*row) for row in rows}
