"""Claim: 100 robots in one process, a client each: commands at 10 Hz all answered in time, pushes at 5 Hz all there.

``--world office`` has walls and furniture; ``--robots`` chooses fewer; ``--still`` lets the robots stand.
"""

from __future__ import annotations

import argparse
import asyncio
import socket
import tempfile
import time
from dataclasses import dataclass, field
from ipaddress import IPv4Address
from pathlib import Path

from _claim import Claims

from roboglot.testing.process import ServedRobot, served

FIRST_ROBOT = IPv4Address("127.1.0.1")
FIRST_CLIENT = IPv4Address("127.2.0.1")
COMMANDS, PUSHES = 10, 5  # Hz
WARM_SECONDS = 5.0


@dataclass(slots=True)
class Pupil:
    """A client: how long its answers took and how many pushes came."""

    index: int
    drive: bytes
    delays: list[float] = field(default_factory=list)
    pushes: int = 0

    async def run(self, seconds: float) -> None:
        loop = asyncio.get_running_loop()
        robot, host = str(FIRST_ROBOT + self.index), str(FIRST_CLIENT + self.index)
        reader, writer = await asyncio.open_connection(robot, 40923, local_addr=(host, 0))
        inbox = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        inbox.bind((host, 40924))
        inbox.setblocking(False)
        writer.write(b"command;chassis push position on pfreq 5;")
        await reader.readuntil(b";ok;")
        await asyncio.sleep(WARM_SECONDS + self.index * 0.001)
        loop.add_reader(inbox, self._pushed, inbox)
        await asyncio.sleep(0.5)
        self.pushes = 0
        start = time.perf_counter()
        for beat in range(round(seconds * COMMANDS)):
            await asyncio.sleep(start + beat / COMMANDS - time.perf_counter())
            began = time.perf_counter()
            writer.write(self.drive)
            await reader.readuntil(b"ok;")
            self.delays.append(time.perf_counter() - began)
        await asyncio.sleep(start + seconds - time.perf_counter())
        loop.remove_reader(inbox)
        inbox.close()
        writer.close()

    def _pushed(self, inbox: socket.socket) -> None:
        self.pushes += inbox.recv(2048).startswith(b"chassis push position")


def name_of(index: int) -> str:
    """Return a robot's name; the first is the one that ``roboglot up`` has by itself."""
    return f"r{index}" if index else "a"


async def measure(robot: ServedRobot, pupils: list[Pupil], seconds: float) -> tuple[float, float]:
    """Share of one core that the server got meanwhile, and seconds of robot time that passed in a real one."""

    async def processor() -> tuple[float, float]:
        await asyncio.sleep(WARM_SECONDS + 1.5)
        cpu, began, pushes = robot.cpu_seconds, time.perf_counter(), sum(pupil.pushes for pupil in pupils)
        await asyncio.sleep(seconds - 2)
        spent = time.perf_counter() - began
        received = sum(pupil.pushes for pupil in pupils) - pushes
        return (robot.cpu_seconds - cpu) / spent, received / len(pupils) / PUSHES / spent

    used, _ = await asyncio.gather(processor(), asyncio.gather(*(pupil.run(seconds) for pupil in pupils)))
    return used


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--robots", type=int, default=100)
    options.add_argument("--world", default="empty")
    options.add_argument("--seconds", type=float, default=20.0)
    options.add_argument("--still", action="store_true")
    chosen, claims = options.parse_args(), Claims()
    drive = b"chassis stop;" if chosen.still else b"chassis speed x 0.1 y 0 z 30;"
    pupils = [Pupil(index, drive) for index in range(chosen.robots)]
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["--world", chosen.world]
        for index in range(chosen.robots):
            arguments += ["--robot", f"{name_of(index)}=robomaster_ep@{FIRST_ROBOT + index}"]
        with served(Path(folder) / "data", *arguments, address=str(FIRST_ROBOT)) as robot:
            print(f"{chosen.robots} robots in {chosen.world}: ready after {robot.ready_after:.1f} s")
            used, passed = asyncio.run(measure(robot, pupils, chosen.seconds))
            memory = robot.resident_megabytes
    delays = sorted(delay for pupil in pupils for delay in pupil.delays)
    wanted = chosen.seconds * len(pupils)
    print(f"{used:.2f} of a core, {memory:.0f} MB, median answer {delays[len(delays) // 2] * 1000:.1f} ms")
    late = sum(delay > 1 / COMMANDS for delay in delays) / len(delays)
    claims.at_most("processor time a robot second", used / passed, 1, "s")  # despite other load on the machine
    claims.at_least("commands answered", len(delays) / wanted, COMMANDS * 0.99, "Hz")
    claims.at_most("answers after the next beat", late * 100, 1, "%")
    claims.at_least("pushes, all robots", sum(pupil.pushes for pupil in pupils) / wanted, PUSHES * 0.98, "Hz")
    claims.at_least("pushes, worst robot", min(p.pushes for p in pupils) / chosen.seconds, PUSHES * 0.95, "Hz")
    claims.finish()


if __name__ == "__main__":
    main()
