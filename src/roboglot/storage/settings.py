"""Settings in the database: one JSON value per key and robot."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping

from roboglot.model.components.system.settings import Settings
from roboglot.storage.transactions import Connection, Transactions


class StoredSettings(Settings):
    """The settings of one robot, with a copy in memory for reading."""

    def __init__(self, database: Transactions, robot: str) -> None:
        self._database = database
        self._robot = robot
        rows = database.run_now(
            lambda c: c.execute("SELECT key, value FROM setting WHERE robot=?", (robot,)).fetchall()
        )
        self._values = {key: json.loads(value) for key, value in rows}

    def get(self, key: str, default: object = None) -> object:
        return self._values.get(key, default)

    async def put_all(self, values: Mapping[str, object]) -> None:
        writes = [self.writing(key, value) for key, value in values.items()]
        kept = json.loads(json.dumps(dict(values)))

        def work(connection: Connection) -> None:
            for write in writes:
                write(connection)

        fewer = all(_loses_entries(self._values.get(key), value) for key, value in kept.items())
        await (self._database.remove(work) if fewer else self._database.run(work))
        self._values |= kept

    def writing(self, key: str, value: object) -> Callable[[Connection], object]:
        """Return the transaction that writes a setting."""
        row = (self._robot, key, json.dumps(value))
        return lambda connection: connection.execute(
            "INSERT INTO setting (robot, key, value) VALUES (?, ?, ?)"
            " ON CONFLICT (robot, key) DO UPDATE SET value=excluded.value",
            row,
        )

    def adopt(self, key: str, value: object) -> None:
        """Take over a written value."""
        self._values[key] = json.loads(json.dumps(value))


def _loses_entries(old: object, new: object) -> bool:
    """Return whether a list of settings, as of known devices, loses entries and gains none."""
    return isinstance(old, list) and isinstance(new, list) and len(new) < len(old) and all(one in old for one in new)
