"""Serves the back end on a port until the process is asked to end."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Sequence

import uvicorn

from roboglot.cloud.application import BackEnd
from roboglot.protocols.browsers import Browsers
from roboglot.storage.cloud import CloudStore
from roboglot.transport.http import BoundedConnection

CONNECTIONS_MAX = 200


class _Server(uvicorn.Server):
    """Server that calls ``listens`` with its URL once it does."""

    def __init__(self, config: uvicorn.Config, listens: Callable[[str], None]) -> None:
        super().__init__(config)
        self._listens = listens

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        host, port = self.config.host, self.servers[0].sockets[0].getsockname()[1]
        self._listens(f"http://{f'[{host}]' if ':' in host else host}:{port}")


def serve(
    store: CloudStore, address: str, port: int, hosts: Sequence[str], listens: Callable[[str], None], *, verbose: bool
) -> None:
    """Serve on ``port`` of ``address`` (0: any free one); ``hosts``: further names that clients use for it.

    ``listens`` gets the URL. Exits with a log line if the port cannot be had.
    """
    config = uvicorn.Config(
        BackEnd(store, Browsers("", (), hosts)),
        http=BoundedConnection,
        ws="none",
        host=address,
        port=port,
        log_config=None,  # as all log lines: without query strings
        log_level="info" if verbose else "warning",
        lifespan="off",
        limit_concurrency=CONNECTIONS_MAX,
    )
    with contextlib.suppress(KeyboardInterrupt):  # a signal that ended it
        _Server(config, listens).run()
