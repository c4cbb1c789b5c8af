"""Blocking access, for tests without an event loop, to objects in the event loop of another thread."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from concurrent.futures import TimeoutError as Late
from contextlib import AbstractAsyncContextManager, AbstractContextManager
from types import TracebackType
from typing import Any

PATIENCE = 60.0  # real s after which a test's call fails


class Loop:
    """An event loop that runs in another thread."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop

    def run(
        self, function: Callable[..., object], *arguments: object, within: float = PATIENCE, **named: object
    ) -> Any:
        """Run a function or coroutine function in the loop; return its result. Raises its errors, and TimeoutError."""

        async def call() -> object:
            result = function(*arguments, **named)
            return await result if inspect.isawaitable(result) and not _is_kept(result) else result

        future = asyncio.run_coroutine_threadsafe(call(), self.loop)
        try:
            return future.result(within)
        except Late:
            if future.done():  # raised by the call itself
                raise
            future.cancel()
            raise TimeoutError(
                f"{getattr(function, '__name__', 'the call')} has not ended after {within:g} s"
            ) from None


class Blocking:
    """An asyncio object with blocking methods. Their results, too, can be waited for (``wait``) and iterated over."""

    def __init__(self, target: object, loop: Loop) -> None:
        self._target, self._loop = target, loop

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._target, name)
        if not callable(value) or isinstance(value, type):
            return self._wrapped(value)

        def call(*arguments: object, within: float = PATIENCE, **named: object) -> object:
            return self._wrapped(self._loop.run(value, *arguments, within=within, **named))

        return call

    def __setattr__(self, name: str, value: object) -> None:
        if name in ("_target", "_loop"):
            object.__setattr__(self, name, value)
        else:
            setattr(self._target, name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *dir(self._target)})

    def __repr__(self) -> str:
        return f"Blocking({self._target!r})"

    def __enter__(self) -> Blocking:
        self._loop.run(_enter, self._target)
        return self

    def __exit__(self, *failure: object) -> None:
        self._loop.run(_exit, self._target, *failure)

    def __iter__(self) -> Iterator[object]:
        while True:
            try:
                yield self.next()
            except StopAsyncIteration:
                return

    def next(self, within: float = PATIENCE) -> Any:
        """Return the next item. Raises TimeoutError, StopAsyncIteration."""
        return self._loop.run(_next, self._target, within=within)

    def wait(self, within: float = PATIENCE) -> Any:
        """Wait for the end of an action or task. Raises its error, and TimeoutError."""

        return self._loop.run(_end, self._target, within=within)

    def _wrapped(self, value: object) -> object:
        return Blocking(value, self._loop) if _is_kept(value) else value


def _is_kept(value: object) -> bool:
    """Return whether ``value`` is an object with methods to await rather than plain data."""
    if inspect.isasyncgen(value):
        return True
    kind = type(value)
    if not kind.__module__.startswith(("roboglot.clients", "roboglot.model.feed", "roboglot.testing")):
        return False
    names = {name for one in kind.__mro__ for name in vars(one)}
    return not names.isdisjoint(("__await__", "__anext__")) or any(
        inspect.iscoroutinefunction(getattr(kind, name, None)) for name in names
    )


async def _next(target: AsyncIterator[object]) -> object:
    return await anext(target)


async def _end(target: Awaitable[object]) -> object:
    return await target


async def _enter(target: AbstractAsyncContextManager[object] | AbstractContextManager[object]) -> None:
    if isinstance(target, AbstractAsyncContextManager):
        await target.__aenter__()
    else:
        target.__enter__()


async def _exit(
    target: AbstractAsyncContextManager[object] | AbstractContextManager[object],
    kind: type[BaseException] | None,
    error: BaseException | None,
    trace: TracebackType | None,
) -> None:
    if isinstance(target, AbstractAsyncContextManager):
        await target.__aexit__(kind, error, trace)
    else:
        target.__exit__(kind, error, trace)
