"""Confirmation of commands that an operation sends on: it ends when they were answered. Knows no robot."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from contextvars import ContextVar, Token
from typing import Self

Sent = asyncio.Task[Exception | None]  # returns why the command was refused; None: it was carried out


class Confirmation:
    """Context that collects the commands sent by its task; tasks begun in it answer for their own.

    Until its first wait, an operation may run without a task (``transport.eager``). All commands count then.
    """

    __slots__ = ("_open", "_sent", "_task", "_token")

    def __init__(self) -> None:
        self._task = asyncio.current_task()
        self._sent: list[Sent] = []
        self._open = True
        self._token: Token[Confirmation | None]

    def __enter__(self) -> Self:
        self._token = _confirmation.set(self)
        return self

    def __exit__(self, *_: object) -> None:
        self._open = False  # tasks begun in it still have it in their context
        _confirmation.reset(self._token)

    async def wait(self) -> None:
        """Wait until all commands were answered. Raises the error of a refused one."""
        if not self._sent:
            return
        await asyncio.wait(self._sent)
        for command in self._sent:
            if (error := command.result()) is not None:
                raise error

    def add(self, command: Sent) -> None:
        """Collect a command, unless another task sent it."""
        if self._open and self._task in (None, asyncio.current_task()):
            self._sent.append(command)


_confirmation: ContextVar[Confirmation | None] = ContextVar("confirmation", default=None)


@asynccontextmanager
async def confirmed() -> AsyncIterator[None]:
    """Context at whose end the commands sent inside were answered. Raises the error of a refused one."""
    with Confirmation() as confirmation:
        yield
    await confirmation.wait()


def confirm(command: Sent) -> None:
    """Have the present operation, if there is one, end after ``command`` was answered."""
    if (confirmation := _confirmation.get()) is not None:
        confirmation.add(command)
