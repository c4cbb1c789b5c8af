"""Claims: 25 pupils in 25 worlds, each with a running program: a lit block <= 250 ms late, each world at real time.

`roboglot fleet up` serves the worlds. Each pupil is a socket of the studio, as a page has it: it joins by the class's
code, is sent to its own world, saves a program of two blocks and a pause, runs it, and reports every 0.7 s what it
does; the teacher's socket hears the grid, and stops all. References: how late this client's own loop was, and the
processors that the worlds took.

    scripts/bench lesson [--worlds 25] [--seconds 20]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from _claim import Claims
from websockets.asyncio.client import ClientConnection, connect

from roboglot.hosting.local_socket import ask
from roboglot.shards.requests import SOCKET

FIRST = "127.79.1.1"
PATIENCE = 120.0
PAUSE = 0.5  # s of the program between two turns
REPORT = 0.7  # s, as the page does
TEMPLATE = '[[robots]]\nname = "a"\nbody = "cyberdog2"\n'
SOURCE = f"""
while True:
    cyberdog.task.block('one')
    cyberdog.task.block('two')
    time.sleep({PAUSE})
"""
TASK = {"type": "task", "target_id": ["t"], "mode": "single", "condition": "now"}
DOING = {"phase": "running", "lit": "two", "program": "lesson", "error": "", "mission": "", "stars": 0}
Message = dict[str, Any]


class Page:
    """A page of the studio without a browser; ``lit``: when its program began a turn, s."""

    socket: ClientConnection

    def __init__(self) -> None:
        self.lit: list[float] = []
        self.began = asyncio.Event()
        self.grids: list[float] = []
        self._inbox: asyncio.Queue[Message] = asyncio.Queue()
        self._reading: asyncio.Task[None] | None = None

    async def open(self, url: str, robot: str) -> None:
        """Open the studio of one world, instead of the one before."""
        await self.close()
        self.socket = await connect(url.replace("http", "ws") + "/studio", max_size=None, open_timeout=PATIENCE)
        self._reading = asyncio.create_task(self._read())
        await self.say(type="open", robot=robot)
        await self.until(lambda message: message["type"] == "opened")

    async def close(self) -> None:
        if self._reading is not None:
            await self.socket.close()
            await self._reading

    async def _read(self) -> None:
        async for text in self.socket:
            now, message = time.monotonic(), json.loads(text)
            if '"block": {"type": "begin"' in message.get("text", ""):
                if not self.lit or now - self.lit[-1] > PAUSE / 2:
                    self.lit.append(now)
                    self.began.set()
            elif message["type"] == "grid" and self.grids:
                self.grids.append(now)
            else:
                self._inbox.put_nowait(message)

    async def say(self, **message: object) -> None:
        await self.socket.send(json.dumps(message))

    async def until(self, wanted: Callable[[Message], bool]) -> Message:
        """Return the first message that is wanted."""
        async with asyncio.timeout(PATIENCE):
            while not wanted(message := await self._inbox.get()):
                pass
        return message

    async def frame(self, operate: str, **more: str) -> None:
        """Send a frame of visual programming and wait for its answer."""
        await self.say(type="frame", text=json.dumps(TASK | {"operate": operate, "id": operate} | more))
        await self.until(lambda message: f'"id": "{operate}"' in message.get("text", ""))

    async def teach(self) -> str:
        """Open a class; return its code."""
        await self.say(type="class", do="open", name="7b")
        return str((await self.until(lambda message: message["type"] == "grid"))["code"])

    async def join(self, code: str, name: str, pages: list[str]) -> None:
        """Join on the first world's page, and continue in the pupil's own world."""
        await self.open(pages[0], "a1")
        while True:
            await self.say(type="class", do="join", code=code, name=name, id=1)
            answer = await self.until(lambda message: message["type"] in ("joined", "elsewhere", "refused"))
            if answer["type"] != "elsewhere":
                break
            await self.open(answer["page"], f"a{pages.index(answer['page']) + 1}")
        if answer["type"] == "refused":
            sys.exit(f"lesson: {name} was refused: {answer['why']}")
        await self.frame("save", body=SOURCE, describe="lesson")

    async def report(self, end: float) -> None:
        """Report what the program does, as the page of a pupil."""
        while time.monotonic() < end:
            await self.say(type="class", do="doing", doing=DOING, style="{}")
            await asyncio.sleep(REPORT)


async def shards(folder: Path) -> list[Message]:
    found: list[Message] = json.loads(await ask(folder / SOCKET, b"{}", PATIENCE))["shards"]
    return found


async def hold(claims: Claims, folder: Path, seconds: float) -> None:
    """Hold the lesson."""
    pages = [str(row["console"]) for row in await shards(folder)]
    teacher, pupils = Page(), [Page() for _ in pages]
    await teacher.open(pages[0], "a1")
    code, began = await teacher.teach(), time.monotonic()
    for number, pupil in enumerate(pupils, start=1):
        await pupil.join(code, f"Pupil {number}", pages)
    print(f"{len(pupils)} pupils joined one after the other in {time.monotonic() - began:.1f} s")
    began = time.monotonic()
    await asyncio.gather(*(pupil.frame("run") for pupil in pupils))
    await asyncio.gather(*(pupil.began.wait() for pupil in pupils))
    print(f"all started together: the last first block was lit after {time.monotonic() - began:.2f} s")
    await asyncio.sleep(1.0)
    marks, used = [len(pupil.lit) for pupil in pupils], sum(row["cpu"] for row in await shards(folder))
    teacher.grids, began = [time.monotonic()], time.monotonic()
    reports = [asyncio.create_task(pupil.report(began + seconds)) for pupil in pupils]
    own = 0.0
    while (due := time.monotonic() + 0.01) < began + seconds:
        await asyncio.sleep(0.01)
        own = max(own, time.monotonic() - due)
    await asyncio.gather(*reports)
    rows, passed = await shards(folder), time.monotonic() - began
    turns = [pairwise(pupil.lit[mark:]) for pupil, mark in zip(pupils, marks, strict=True)]
    late = sorted(after - before - PAUSE for each in turns for before, after in each)
    median, most = statistics.median(late) * 1e3, late[len(late) * 95 // 100] * 1e3
    print(f"{len(late)} turns: {median:.0f} ms late, 95 % at most {most:.0f}")
    print(f"reference: this client's own loop was at most {own * 1e3:.0f} ms late")
    print(f"reference: the worlds took {(sum(row['cpu'] for row in rows) - used) / passed:.2f} cores")
    claims.at_most("a lit block, late", late[-1] * 1e3, 250.0, "ms")
    claims.at_least("slowest world", min(row["factor"] for row in rows), 0.98, "x real time")
    gaps = [after - before for before, after in pairwise(teacher.grids)]
    claims.at_most("teacher's grid, longest pause", max(gaps, default=PATIENCE), 1.5, "s")
    began = time.monotonic()
    await teacher.say(type="class", do="stop_all", id=9)
    await asyncio.gather(*(pupil.until(lambda m: "state is shutdown" in m.get("text", "")) for pupil in pupils))
    claims.at_most("stop all", time.monotonic() - began, 1.0, "s")
    for page in (teacher, *pupils):
        await page.close()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=25)
    parser.add_argument("--seconds", type=float, default=20.0)
    chosen, claims = parser.parse_args(), Claims()
    with tempfile.TemporaryDirectory() as name:
        folder, template = Path(name) / "fleet", Path(name) / "class.toml"
        template.write_text(TEMPLATE)
        command = [sys.executable, "-m", "roboglot", "fleet", "up", "--data", str(folder), "--first-address", FIRST]
        command += ["--worlds", str(chosen.worlds), "--template", str(template)]
        with (Path(name) / "log").open("w") as log:
            fleet = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        assert fleet.stdout is not None
        try:
            print(fleet.stdout.readline().strip() or (Path(name) / "log").read_text())
            asyncio.run(hold(claims, folder, chosen.seconds))
        finally:
            fleet.send_signal(signal.SIGINT)
            fleet.wait()
    claims.finish()


if __name__ == "__main__":
    main()
