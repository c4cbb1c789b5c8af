"""Documents in the database: one JSON value per kind, id and robot."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from roboglot.model.components.system.ledger import Ledger
from roboglot.storage.transactions import Connection, Transactions


class StoredLedger(Ledger):
    """The documents of one robot. ``all`` blocks: it is for start-up."""

    def __init__(self, database: Transactions, robot: str) -> None:
        self._database, self._robot = database, robot

    def all(self, kind: str) -> Sequence[tuple[str, object]]:
        rows = self._database.run_now(
            lambda c: c.execute(
                "SELECT id, document FROM ledger WHERE robot=? AND kind=? ORDER BY seq", (self._robot, kind)
            ).fetchall()
        )
        return [(id, json.loads(document)) for id, document in rows]

    async def write(self, kind: str, documents: Mapping[str, object], *, forget: Sequence[str] = ()) -> None:
        rows = [(self._robot, kind, id, json.dumps(document)) for id, document in documents.items()]

        def work(connection: Connection) -> None:
            connection.executemany(
                "INSERT INTO ledger (robot, kind, id, document) VALUES (?, ?, ?, ?)"
                " ON CONFLICT (robot, kind, id) DO UPDATE SET document=excluded.document",
                rows,
            )
            connection.executemany(
                "DELETE FROM ledger WHERE robot=? AND kind=? AND id=?", [(self._robot, kind, id) for id in forget]
            )

        await (self._database.run(work) if rows else self._database.remove(work))
