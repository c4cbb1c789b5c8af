"""A shard as an actor: the same code as in a forked process, in a thread of a process started by Ray.

Ray restarts a process that exits, on another node if its own is gone.
"""

from __future__ import annotations

import logging
import os
import secrets
import socket
import threading
import time
from collections import deque
from pathlib import Path

import msgspec

from roboglot.shards.messages import MESSAGE_MAX, Beat, News, Ready, Refusal, pair

AGAIN_SECONDS = 1.0  # s until the process of an ended shard exits, so that Ray restarts it
STOP_SECONDS = 12.0
LINES_MAX = 2000  # log lines kept until the fleet fetches them
EXIT_ENDED = 1
NODE_DIGITS = 12  # of a node's id
RUN_BITS = 53  # of a run's number, so that JSON keeps it exactly


class Condition(msgspec.Struct):
    """State of a shard: its last report and its node. ``lines``: log lines since the last look.

    ``ready`` is left out if the client has it already, as a hundred robots' endpoints are long. ``run``: a number that
    differs in every process, unlike pids of different machines.
    """

    pid: int
    node: str
    run: int
    serving: bool
    up: bool
    ready: Ready | None
    beat: Beat | None
    refusal: Refusal | None
    lines: list[str]


class _Lines(logging.Handler):
    """Keeps log lines until they are fetched."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.kept: deque[str] = deque(maxlen=LINES_MAX)

    def emit(self, record: logging.LogRecord) -> None:
        self.kept.append(self.format(record))


class ShardActor:
    """Serves one shard from its beginning to ``stop``.

    ``of_node``: nodes share no folders, so each uses a separate subfolder.
    """

    def __init__(self, settings: dict[str, object], folder: str, *, of_node: bool) -> None:
        import ray

        from roboglot.hosting.logs import in_shape, set_up_logging
        from roboglot.shards.shard import write_settings

        self._node = ray.get_runtime_context().get_node_id()[:NODE_DIGITS]
        self._run = secrets.randbits(RUN_BITS) or 1
        self._lines = _Lines()
        self._stopping = False
        self._ready: Ready | None = None
        self._beat: Beat | None = None
        self._refusal: Refusal | None = None
        place = Path(folder)
        if of_node:
            place /= self._node
            settings = settings | {"data": str(Path(str(settings["data"])) / self._node)}
        write_settings(place, settings)
        set_up_logging(verbose=False)
        own = logging.getLogger("roboglot")
        own.setLevel(logging.INFO)
        own.addHandler(in_shape(self._lines))
        self._link, theirs = pair()
        self._link.setblocking(False)
        self._turn = threading.Lock()
        self._serving = threading.Thread(target=self._serve, args=(str(place), theirs), name="shard", daemon=True)
        self._serving.start()

    def look(self, known: int) -> bytes:
        """Return the encoded Condition. ``known``: the run whose ``ready`` the client has."""
        with self._turn:
            self._receive()
            lines = [self._lines.kept.popleft() for _ in range(len(self._lines.kept))]
            serving, up = self._serving.is_alive(), self._ready is not None
            ready = None if known == self._run else self._ready
            state = Condition(os.getpid(), self._node, self._run, serving, up, ready, self._beat, self._refusal, lines)
            return msgspec.json.encode(state)

    def stop(self) -> bytes:
        """Close robots and doors in order."""
        self._stopping = True
        with self._turn:
            self._link.close()
        self._serving.join(STOP_SECONDS)
        return b""

    def _serve(self, folder: str, link: socket.socket) -> None:
        from roboglot.shards.shard import run

        try:
            run(folder, link)
        except BaseException:
            logging.getLogger(__name__).exception("the shard ended")
        finally:
            with self._turn:
                self._receive()
            if not self._stopping and not (self._refusal and self._refusal.lasting):
                time.sleep(AGAIN_SECONDS)
                os._exit(EXIT_ENDED)  # Ray restarts the actor

    def _receive(self) -> None:
        """Read the messages that the shard has sent since the last call."""
        while not self._stopping:
            try:
                packet = self._link.recv(MESSAGE_MAX)
            except OSError:
                return
            if not packet:
                return
            match msgspec.json.decode(packet, type=News):
                case Ready() as ready:
                    self._ready = ready
                case Beat() as beat:
                    self._beat = beat
                case Refusal() as refusal:
                    self._refusal = refusal
