"""Documents that wait to be sent, in order. Knows neither their meaning nor their destination."""

from __future__ import annotations

from roboglot.storage.program_errors import store_errors
from roboglot.storage.transactions import Connection, Transactions

OUTBOX_MAX = 10_000  # documents per robot; the oldest are dropped first


class Outbox:
    """Outbox of one robot. When ``put`` returns, the document survives a crash."""

    def __init__(self, database: Transactions, robot: str) -> None:
        self._database = database
        self._robot = robot

    async def put(self, document: str) -> None:
        """Append a document."""

        def work(connection: Connection) -> None:
            connection.execute("INSERT INTO cloud_outbox (robot, document) VALUES (?, ?)", (self._robot, document))
            connection.execute(
                "DELETE FROM cloud_outbox WHERE robot=? AND seq <= (SELECT seq FROM cloud_outbox WHERE robot=?"
                " ORDER BY seq DESC LIMIT 1 OFFSET ?)",
                (self._robot, self._robot, OUTBOX_MAX),
            )

        with store_errors():
            await self._database.run(work)

    async def first(self) -> tuple[int, str] | None:
        """Return the oldest document with its number; None if there is none."""
        query = "SELECT seq, document FROM cloud_outbox WHERE robot=? ORDER BY seq LIMIT 1"
        return await self._database.run(lambda connection: connection.execute(query, (self._robot,)).fetchone())

    async def remove(self, number: int) -> None:
        """Delete a document that was sent, or never will be."""
        await self._database.remove(
            lambda connection: connection.execute("DELETE FROM cloud_outbox WHERE seq=?", (number,))
        )
