"""A terminal beside a running robot: types the lines of a page, and lets robot time pass meanwhile.

The lines run as they are in the page, in bash, but for the address. ``sleep`` and ``timeout`` are others, so that
nothing depends on the machine's speed: sleeping is short, and what ``timeout`` runs ends with the robot's last answer.
"""

from __future__ import annotations

import ast
import asyncio
import gc
import os
import re
import shutil
import sys
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import pytest

from roboglot.config import AccessConfig, Config, ConsoleConfig, RecordConfig, RobotConfig
from roboglot.model.clock import LockstepClock
from roboglot.model.events import BumperPressed
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_port

ROOT = Path(__file__).parents[2]
TICK, PAUSE = 0.1, 0.01  # s of the robot, of the machine
PATIENCE = 300.0  # s of the machine: for tests that fail
TOOLS = {
    "sleep": "#!/bin/sh\nexec /bin/sleep 0.05\n",
    # bash reads until each command has its answer; `timeout 5 cat` would wait five seconds
    "timeout": "#!/bin/bash\nfor ((n = ANSWERS; n > 0; n--)); do read -rd';' answer; printf '%s;' \"$answer\"; done\n",
}
T = TypeVar("T")


@dataclass
class Ended:
    """Result of a command."""

    line: str
    status: int
    said: str


@dataclass
class Terminal:
    """A terminal in a folder with the clone's .venv and examples, beside robot a."""

    runtime: Runtime
    address: str
    folder: Path
    start: Pose  # the robot's place in the world
    app_port: int  # called by the robot
    bumps: list[BumperPressed] = field(default_factory=list)
    track: list[Pose] = field(default_factory=list)  # true places, seen from the start

    @property
    def robot(self) -> Robot:
        return self.runtime.fleet.robots["a"]

    @property
    def moved(self) -> Pose:
        """True pose of the robot, seen from its start."""
        return self.runtime.fleet.world.truth.pose_of("a").relative_to(self.start)

    async def meanwhile(self, awaitable: Awaitable[T]) -> T:
        """Let robot time pass until it is done."""
        task = asyncio.ensure_future(awaitable)
        async with asyncio.timeout(PATIENCE):
            while not task.done():
                await self.forward(TICK)
                await asyncio.sleep(PAUSE)
        return task.result()

    async def forward(self, seconds: float) -> None:
        assert isinstance(self.runtime.clock, LockstepClock)
        await self.runtime.clock.advance(seconds)
        if self.runtime.config.robots[0].is_simulated:
            self.track.append(self.moved)

    async def stand(self) -> None:
        """Wait until the robot does nothing any more."""
        await self.forward(0.5)
        for _ in range(100):
            if not self.robot.actions.running():
                break
            await self.forward(0.5)

    async def run(self, code: str, *, lines: int = 0) -> list[Any]:
        """Run Python of a page; ``lines``: until it has printed so many. What it printed."""
        for host in re.findall(r"192\.168\.[\d.]+", code):
            code = code.replace(f'{host}"', f'{self.address}"')
        code = code.replace('Path("phone"))', f'Path("{self.folder}/phone")), app_port={self.app_port}')
        printed: list[Any] = []
        names: dict[str, Any] = {"print": printed.append}
        running = asyncio.ensure_future(eval(compile(code, "page", "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT), names))

        async def read() -> None:
            while not running.done() and not (lines and len(printed) >= lines):
                await asyncio.wait([running], timeout=PAUSE)

        await self.meanwhile(read())
        if not running.done():
            running.cancel()
        await self.meanwhile(asyncio.wait([running]))
        if not running.cancelled():
            running.result()
        return printed

    async def type(self, line: str) -> Ended:
        """Run a line in bash and wait for its end; skip the test if the line needs curl, and there is none."""
        if "curl " in line and shutil.which("curl") is None:
            pytest.skip("needs curl")
        line = line.replace("127.0.0.1", self.address)
        environment = {
            **os.environ,
            "PATH": f"{self.folder / 'tools'}:{os.environ['PATH']}",
            "ROBOGLOT_DATA": str(self.runtime.config.data),
            "ROBOGLOT_PROGRAMS": f"ws://{self.address}:50053",
            "ROBOGLOT_CYBERDOG": self.address,
            "ROBOT": self.address,
            "ANSWERS": str(line.count(";", line.find("printf '"), line.rfind("' >&3"))),
        }
        nothing, pipe, log = asyncio.subprocess.DEVNULL, asyncio.subprocess.PIPE, asyncio.subprocess.STDOUT
        process = await asyncio.create_subprocess_exec(
            "bash", "-c", line, cwd=self.folder, env=environment, stdin=nothing, stdout=pipe, stderr=log
        )
        said, _ = await self.meanwhile(process.communicate())
        assert process.returncode is not None
        return Ended(line, process.returncode, said.decode())

    async def type_block(self, block: str) -> list[Ended]:
        """Run a block's commands one by one, in one shell's variables; each must end well."""
        variables, ended = "", []
        for command in commands(block):
            if command.partition("=")[0].isidentifier():
                variables += command + "\n"
                continue
            ended.append(await self.type(variables + command))
            assert ended[-1].status == 0, ended[-1]
        return ended


def commands(block: str) -> list[str]:
    """Commands of a shell block, continued lines joined, comments dropped."""
    found: list[str] = []
    open_one = False
    for line in block.splitlines():
        if open_one:
            found[-1] += "\n" + line
        elif line.strip() and not line.startswith("#"):
            found.append(line)
        else:
            continue
        text = found[-1]
        bare = text.replace('\\"', "")
        inside = bare.count("'") % 2 if not bare.startswith("bash -c") else bare.count('"') % 2
        open_one = bool(inside) or text.endswith("\\")
    return found


@asynccontextmanager
async def terminal(
    folder: Path,
    address: str,
    body: str = "universal",
    access: AccessConfig | None = None,
    world: str = "office",
    record: str = "",
) -> AsyncIterator[Terminal]:
    """``roboglot up`` in lockstep, in this process, with the doors' own ports, and someone beside it."""
    (folder / "tools").mkdir()
    for name, text in TOOLS.items():
        (folder / "tools" / name).write_text(text)
        (folder / "tools" / name).chmod(0o755)
    (folder / ".venv").symlink_to(sys.prefix)
    (folder / "examples").symlink_to(ROOT / "examples")
    dog = CyberDogConfig(app_port=free_port())
    robots = (RobotConfig("a", body, address),)
    console = ConsoleConfig(address=address)
    config = Config(
        robots=robots,
        lockstep=True,
        data=folder / "data",
        doors={"cyberdog": dog},
        console=console,
        access=access or AccessConfig(),
        world=world,
        record=RecordConfig(to=record),
    )
    runtime = Runtime(config)
    try:
        await runtime.start()
        start = runtime.fleet.world.truth.pose_of("a") if robots[0].is_simulated else Pose()
        opened = Terminal(runtime, address, folder, start, dog.app_port)
        leave = opened.robot.events.listen(BumperPressed, opened.bumps.append)
        yield opened
        leave()
        assert not opened.bumps
    finally:
        await runtime.close()
        gc.unfreeze()
