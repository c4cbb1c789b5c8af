"""Claim: a robot that is driven through `roboglot connect` at 0.5 m/s stands within 0.5 s of the tunnel's loss.

Robot and gateway are here, `roboglot connect` and the vendor's client beyond a network device whose packets can be
held back, so that neither end's TCP is notified. The client drives by the text protocol. Times are from the fault until
the wheels' speed has fallen by a tenth, and until they stand. The last row drives for a while over a line that loses
5 % and takes 50 ms each way: how often is that taken for a loss? It makes itself root of a network of its own.

    scripts/bench lost_tunnel
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
from pathlib import Path

from _claim import Claims

from roboglot.access.store import Grant, open_store
from roboglot.config import AccessConfig, RobotConfig, load_config
from roboglot.model.components.motion.base import Base
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.runtime import Runtime

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.access.lossy_device import LossyDevice

ROBOT, HERE, PORT = "127.0.98.1", "127.0.98.2", 50090
SPEED = 0.5  # m/s
TURNING = 0.5  # rad/s, on the spot: away from walls
STOPPED = 0.02  # m/s
CLAIMED = 0.5  # s
PATIENCE = 8.0  # s
TIMES = 8  # trials per row
LOSSY_SECONDS = 240.0
BODIES = ("universal", "robomaster_ep", "cyberdog2")


@dataclass
class Scene:
    """A robot, and what lies between it and its client."""

    robot: Robot
    line: LossyDevice
    connect: asyncio.subprocess.Process
    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter

    async def drive(self) -> None:
        """Have it drive."""
        self.writer.write(b"command;chassis speed x %.1f;" % SPEED)
        await _until(lambda: self.robot[Base].velocity.x > 0.95 * SPEED)


@contextlib.asynccontextmanager
async def scene(body: str, delay: float = 0.0, loss: float = 0.0) -> AsyncIterator[Scene]:
    with tempfile.TemporaryDirectory() as folder, LossyDevice(delay=delay, loss=loss) as line:
        data = Path(folder) / "data"
        store = open_store(data)
        token = store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
        store.close()
        base = load_config(None, {"data": str(data), "world": "empty"})
        access = AccessConfig(on=True, local=False, gateway=f"{line.near}:{PORT}")
        runtime = Runtime(replace(base, robots=(RobotConfig("a", body, ROBOT),), access=access))
        await runtime.start()
        environment = {**os.environ, "ROBOGLOT_TOKEN": token, "XDG_CONFIG_HOME": folder}
        command = ("-m", "roboglot", "connect", f"{line.far}:{PORT}", "--address", HERE, "--once")
        connect = await asyncio.create_subprocess_exec(
            sys.executable, *command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        assert connect.stdout
        assert (await connect.stdout.readline()).startswith(b"ready")
        reader, writer = await asyncio.open_connection(HERE, 40923)
        try:
            yield Scene(runtime.fleet.robots["a"], line, connect, reader, writer)
        finally:
            writer.transport.abort()
            with contextlib.suppress(ProcessLookupError):
                connect.kill()
            await connect.wait()
            await runtime.close()


async def _until(reached: Callable[[], bool]) -> float:
    """s until then; inf: not in time."""
    begun = time.monotonic()
    while not reached():
        if time.monotonic() - begun > PATIENCE:
            return float("inf")
        await asyncio.sleep(0.002)
    return time.monotonic() - begun


async def lose(body: str, fault: Callable[[Scene], None]) -> tuple[float, float]:
    async with scene(body) as it:
        await it.drive()
        await asyncio.sleep(0.7)
        assert it.robot[Base].velocity.x > 0.95 * SPEED, "it does not drive"
        fault(it)
        begun = time.monotonic()
        await _until(lambda: it.robot[Base].velocity.x < 0.9 * SPEED)
        ordered = time.monotonic() - begun
        await _until(lambda: it.robot[Base].velocity.speed < STOPPED)
        return ordered, time.monotonic() - begun


async def endure() -> int:
    """Count its stops on a lossy line."""
    stops = -1
    async with scene("universal", delay=0.05, loss=0.05) as it:

        def turning() -> bool:
            return abs(it.robot[Base].velocity.yaw) > 0.8 * TURNING

        end = time.monotonic() + LOSSY_SECONDS
        while time.monotonic() < end:
            if not turning():
                stops += 1
                it.writer.write(b"command;chassis speed z 30;")
                await _until(turning)
            await asyncio.sleep(0.005)
    return stops


def cut(it: Scene) -> None:
    it.line.cut = True


FAULTS: dict[str, Callable[[Scene], None]] = {
    "line dead": cut,
    "connect frozen": lambda it: it.connect.send_signal(signal.SIGSTOP),
    "connect killed": lambda it: it.connect.kill(),
}


def main() -> None:
    if os.environ.get("ALONE") != "1":
        alone = ("unshare", "--user", "--map-root-user", "--net", "sh", "-c", 'ip link set lo up; exec "$@"', "sh")
        sys.exit(subprocess.run([*alone, sys.executable, *sys.argv], env=os.environ | {"ALONE": "1"}).returncode)
    claims = Claims()
    for body in BODIES:
        for name, fault in FAULTS.items():
            seen = [asyncio.run(lose(body, fault)) for _ in range(TIMES)]
            ordered, stands = (sorted(figures) for figures in zip(*seen, strict=True))
            print(f"{body}, {name}: brakes {ordered[0]:.3f} to {ordered[-1]:.3f} s, stands {stands[0]:.3f} s at best")
            claims.at_most(f"{name}, {body}, of {TIMES} the worst", stands[-1], CLAIMED, "s")
    stops = asyncio.run(endure())
    print(f"{LOSSY_SECONDS:.0f} s over a line that loses 5 % and takes 50 ms: taken for dead {stops} times")
    claims.at_most("stops a minute on that line", 60 * stops / LOSSY_SECONDS, 2.0, "/min")
    claims.finish()


if __name__ == "__main__":
    main()
