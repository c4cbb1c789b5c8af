"""Stepping through a program from the terminal: its halts, and the commands typed there. Knows no frame."""

from __future__ import annotations

import asyncio
import json
import sys
import threading
from collections.abc import Sequence
from typing import Any

from roboglot.clients.errors import LinkLost
from roboglot.clients.visual import TextLink
from roboglot.hosting.escaping import visible

HELP = "Enter: next statement, c: go on, q: end it"


class Stepper:
    """Halts ``task`` at ``lines``, and with ``first`` before its first statement; ``debug``: the robot's ``/debug``."""

    def __init__(self, debug: TextLink, task: str, source: str, lines: Sequence[int], first: bool) -> None:
        self._debug, self._task, self._source = debug, task, source.splitlines()
        self._lines, self._first = lines, first
        self._typed: asyncio.Queue[str] = asyncio.Queue()
        self._loop = asyncio.get_running_loop()
        self._reading = False

    async def prepare(self) -> str:
        """Set the places to halt at, once the task is saved; return the error, "" for none."""
        return str((await self._ask("break", lines=list(self._lines), first=self._first))["error"])

    async def halted(self) -> bool:
        """Show the place and run the typed command; False ends the program. Without a terminal it continues."""
        where = await self._ask("where")
        if where["state"] != "suspend":
            return True
        line, module = where["line"], where["module"]
        text = self._source[line - 1] if not module and 0 < line <= len(self._source) else f"(in {module})"
        print(visible(f"‖ {line:4} {text}"), file=sys.stderr, flush=True)
        match (await self._type()).strip().lower():
            case "q":
                return False
            case "c":
                await self._ask("go")
            case _:
                await self._ask("step")
        return True

    async def _ask(self, operate: str, **fields: Any) -> dict[str, Any]:
        await self._debug.send(json.dumps({"target_id": self._task, "operate": operate} | fields))
        async for text in self._debug:
            answer: dict[str, object] = json.loads(text)
            return answer
        raise LinkLost("the robot went away")

    async def _type(self) -> str:
        """Return a typed line; "c" at the end of input. Read in a daemon thread, as Ctrl-C would hang otherwise."""
        if not self._reading:
            self._reading = True
            print(f"  {HELP}", file=sys.stderr, flush=True)
            threading.Thread(target=self._read, daemon=True).start()
        return await self._typed.get()

    def _read(self) -> None:
        try:
            for line in sys.stdin:
                self._loop.call_soon_threadsafe(self._typed.put_nowait, line)
            while not self._loop.is_closed():
                self._loop.call_soon_threadsafe(self._typed.put_nowait, "c")
                threading.Event().wait(0.05)
        except RuntimeError:
            return  # the program has ended meanwhile
