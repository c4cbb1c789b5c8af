"""On whose behalf something is done: a door names its client once, whatever follows from that remembers it.

A context variable, so that it passes through every call and every task that is begun, and no signature knows of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import Context, ContextVar, copy_context

NAME_MAX = 80  # characters of a client's name
_client: ContextVar[str] = ContextVar("client", default="")
_connection: ContextVar[str] = ContextVar("connection", default="")
_robot: ContextVar[str] = ContextVar("robot", default="")
_identity: ContextVar[str] = ContextVar("identity", default="")


def ask_for(client: str, connection: str = "", identity: str = "") -> None:
    """From here on, in this task and those it begins, what is done is done for ``client``: "slamware 10.0.0.7".

    ``connection`` is the address of the client's end, with its port; ``identity`` is who it showed to be.
    """
    _client.set(client.strip()[:NAME_MAX])
    _connection.set(connection)
    _identity.set(identity)


def client() -> str:
    """The client's name; empty: no client asked, the robot or the program acts by itself."""
    return _client.get()


def connection() -> str:
    """Over which connection it was asked; empty: over none, or over one that is not known."""
    return _connection.get()


def identity() -> str:
    """Return the client's admitted identity; empty if no client is acting: the robot or a program acts by itself."""
    return _identity.get()


@contextmanager
def asking_for(client: str) -> Iterator[None]:
    """``ask_for`` inside ``with``: for programs that drive robots in Python."""
    token = _client.set(client.strip()[:NAME_MAX])
    try:
        yield
    finally:
        _client.reset(token)


@contextmanager
def concerning(robot: str) -> Iterator[None]:
    """Inside ``with``, and in what is begun there (tasks, sockets, timers): it is about ``robot``; the log names it."""
    token = _robot.set(robot)
    try:
        yield
    finally:
        _robot.reset(token)


def context_of(robot: str) -> Context:
    """Return a context whose ``run`` is ``concerning`` at a tenth of the price, for what is done at every tick."""
    with concerning(robot):
        return copy_context()


def concerned() -> str:
    """Name of the robot that this is about; empty: none, or all of them."""
    return _robot.get()
