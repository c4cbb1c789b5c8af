"""The server is killed again and again while it saves, runs, schedules and deletes: what it had acknowledged is there,
no run is lost or doubled, nothing is half written.

A few kills here; ROBOGLOT_KILLS=200 for as many as the claim says.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import sqlite3
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from tests.protocols.visual.front_end import Frame

KILLS = int(os.environ.get("ROBOGLOT_KILLS", "6"))
SPEED = 600.0  # a robot minute is 0.1 s here
PATIENCE = 60.0  # s of the machine's time
TASKS = ("t", "t1", "t10", "t100")
MODULES = ("m", "m1")
PADDING = "# " + "x" * 40_000


class Server:
    """One life of the server."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.frames: list[Frame] = []
        self.arrived = asyncio.Condition()
        self.reading = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, database: Path) -> Server:
        script = Path(__file__).with_name("frame_server.py")
        pipe = asyncio.subprocess.PIPE
        return cls(
            await asyncio.create_subprocess_exec(
                sys.executable,
                str(script),
                str(database),
                str(SPEED),
                stdin=pipe,
                stdout=pipe,
                stderr=asyncio.subprocess.DEVNULL,
                limit=1 << 23,
            )
        )

    async def _read(self) -> None:
        assert self.process.stdout
        async for line in self.process.stdout:
            async with self.arrived:
                frame = json.loads(line)
                self.frames.append(frame.get("feedback") or frame["response"])
                self.arrived.notify_all()

    def send(self, frame: Frame) -> None:
        assert self.process.stdin
        self.process.stdin.write(json.dumps(frame).encode() + b"\n")

    def answer(self, id: str) -> Frame | None:
        return next((frame for frame in self.frames if frame["id"] == id), None)

    async def until(self, condition: Any) -> None:
        async with self.arrived:
            await asyncio.wait_for(self.arrived.wait_for(condition), PATIENCE)

    async def kill(self) -> None:
        self.process.kill()
        await self.process.wait()
        await self.reading


class Ledger:
    """Expected contents of the database, by what was acknowledged."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.count = 0
        self.bodies: dict[tuple[str, str], str | None] = dict.fromkeys(
            [("task", id) for id in TASKS] + [("module", id) for id in MODULES]
        )
        self.runs: Counter[str] = Counter()
        self.unsure: Counter[str] = Counter()
        self.called_off: Counter[str] = Counter()
        self.starts: Counter[str] = Counter()
        self.shutdowns: Counter[str] = Counter()  # of the server's current life

    def frame(self) -> Frame:
        """Something to ask for."""
        self.count += 1
        kind = self.chance.choice(["task"] * 4 + ["module"])
        target = self.chance.choice(TASKS if kind == "task" else MODULES)
        operate = self.chance.choice(["save", "run", "run", "later", "later", "shutdown", "delete"])
        if kind == "module":
            operate = self.chance.choice(["save", "delete"])
        if self.bodies[kind, target] is None and self.chance.random() < 0.9:
            operate = "save"
        frame = {"type": kind, "id": f"f{self.count}", "operate": operate, "target_id": [target]}
        match kind, operate:
            case "task", "save":
                use = self.chance.choice(["", "\nf_m()" if self.bodies["module", "m"] else ""])
                body = f"print({self.count}){use}\n{PADDING}\nx = {self.count}"
                frame |= {"mode": "single", "condition": "now", "body": body}
            case "module", "save":
                frame |= {"mode": "common", "condition": f"f_{target}()", "body": f"pass\n{PADDING}\nx = {self.count}"}
            case _, "run":
                frame |= {"mode": "single", "condition": "now"}
            case _, "later":
                frame |= {"operate": "run", "mode": "single", "condition": "now + 5minutes"}
        return frame

    def acknowledge(self, frame: Frame, answer: Frame) -> bool:
        """Return whether the answer says that it counts; a wrong body (23) is kept, too."""
        key = (frame["type"], frame["target_id"][0])
        if answer["state"] and (frame["operate"], answer["state"]) != ("save", 23):
            return False
        match frame["operate"]:
            case "save":
                self.bodies[key] = frame["body"]
            case "delete":
                self.bodies[key] = None
            case "run":
                self.runs[key[1]] += 1
        return True

    def compare(self, database: Path, in_flight: Frame | None) -> dict[str, str]:
        """Assert that a kill left what was acknowledged, but for what was in flight; return the states of tasks."""
        connection = sqlite3.connect(f"file:{database}?mode=ro", uri=True)
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        rows = connection.execute("SELECT kind, id, body, state FROM program").fetchall()
        uses = connection.execute("SELECT kind, id, module FROM program_use").fetchall()
        connection.close()
        found = {(kind, id): body for kind, id, body, _ in rows}
        for key, body in self.bodies.items():
            allowed = [body]
            if in_flight and key == (in_flight["type"], in_flight["target_id"][0]):
                allowed += {"save": [in_flight.get("body")], "delete": [None]}.get(in_flight["operate"], [])
            assert found.get(key) in allowed, key
            self.bodies[key] = found.get(key)
        assert set(found) <= set(self.bodies)
        for kind, id, module in uses:
            assert (kind, id) in found
            assert ("module", module) in found
        return {id: state for kind, id, _, state in rows if kind == "task"}


@pytest.mark.slow  # more kills than test_killed_runs.py
async def test_kills(tmp_path: Path) -> None:
    chance = random.Random(7)
    ledger, database = Ledger(chance), tmp_path / "robot.db"
    for _ in range(KILLS):
        server = await Server.start(database)
        in_flight = await live(server, ledger)
        await asyncio.sleep(chance.choice([0.0, chance.uniform(0, 0.03), chance.uniform(0, 0.3)]))
        await server.kill()
        answered = server.answer(in_flight["id"])
        target = in_flight["target_id"][0]
        if answered is not None and ledger.acknowledge(in_flight, answered):
            if in_flight["operate"] == "run" and last_news(server, target, before=in_flight["id"]) == "start":
                ledger.runs[target] -= 1
        elif in_flight["operate"] == "run":
            ledger.unsure[target] += 1
        ledger.called_off[target] += in_flight["operate"] == "shutdown"
        states = ledger.compare(database, None if answered else in_flight)
        count_starts(server, ledger, states)
    server = await Server.start(database)
    for number in range(1000):  # tasks that wait for their time run now
        id = f"last{number}"
        server.send({"type": "task", "id": id, "operate": "inquiry", "target_id": []})
        await server.until(lambda: server.answer(id))  # noqa: B023
        answer = server.answer(id)
        assert answer is not None
        if all(task["operate"] not in ("run_wait", "run") for task in answer["list"]):
            break
        await asyncio.sleep(0.05)
    await server.kill()
    count_starts(server, ledger, ledger.compare(database, None))
    for id in TASKS:
        least, most = ledger.runs[id] - ledger.called_off[id], ledger.runs[id] + ledger.unsure[id]
        assert least <= ledger.starts[id] <= most, id
    print(f"{KILLS} kills, {ledger.count} operations, {sum(ledger.starts.values())} runs")


async def live(server: Server, ledger: Ledger) -> Frame:
    """Some operations one after the other, then one whose answer no one waits for."""
    for _ in range(ledger.chance.randrange(10)):
        frame = ledger.frame()
        server.send(frame)
        await server.until(lambda: server.answer(frame["id"]))  # noqa: B023
        answer = server.answer(frame["id"])
        assert answer is not None
        assert answer["state"] in (0, 23, 26, 27), answer
        if ledger.acknowledge(frame, answer):
            await settled(server, ledger, frame)
    last = ledger.frame()
    server.send(last)
    return last


async def settled(server: Server, ledger: Ledger, frame: Frame) -> None:
    """A run of what runs already begins nothing; one that is called off before it begins is none either."""
    id = frame["target_id"][0]
    if frame["operate"] == "run" and last_news(server, id, before=frame["id"]) == "start":
        ledger.runs[id] -= 1
    elif frame["operate"] == "shutdown":
        ledger.shutdowns[id] += 1
        await server.until(lambda: news(server, id, "shutdown") >= ledger.shutdowns[id])
        if ledger.runs[id] > ledger.starts[id] + news(server, id, "start"):
            ledger.runs[id] -= 1


def of(server: Server, id: str) -> list[Frame]:
    """Return the task's own reports, in order."""
    return [
        frame
        for frame in server.frames
        if frame.get("target_id") == id and frame["id"].startswith("task_") and frame["operate"] != "run"
    ]


def news(server: Server, id: str, operate: str) -> int:
    return sum(frame["operate"] == operate for frame in of(server, id))


def last_news(server: Server, id: str, before: str = "") -> str:
    """start, stop or shutdown, whichever came last, before the answer to a frame."""
    until = next((n for n, frame in enumerate(server.frames) if frame["id"] == before), len(server.frames))
    earlier = server.frames[:until]
    return next((frame["operate"] for frame in reversed(of(server, id)) if frame in earlier), "")


def count_starts(server: Server, ledger: Ledger, states: dict[str, str]) -> None:
    """Begun is what was reported to have begun, and what was written down as running right before the kill."""
    for id in TASKS:
        ledger.starts[id] += news(server, id, "start")
        ledger.starts[id] += states.get(id) == "run" and last_news(server, id) != "start"
    ledger.shutdowns.clear()
