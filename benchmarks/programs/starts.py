"""Claims: what starts robots of its own answers <= 0.2 s after it was asked for, forked from the warm parent.

Cold and forked in turns, with the memory of the process that has the robot (PSS) when it has answered:
`roboglot program run --own` until it prints, and the test kit's first `robot_server` of a pytest-xdist worker until
REST answers. Beside them what needs no parent, because its process is warm: the worker's second `robot_server`, and
the studio's *simulate first* until its first news. The machine's noise: in the same turns, two bare Pythons, one after
the other (`--own` waits for as many: the command's, and the program's), until the second has ended.

    scripts/bench starts [--rounds 5] [--forked]
"""

from __future__ import annotations

import argparse
import asyncio
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from _claim import Claims

from roboglot.hosting import installation
from roboglot.hosting.installation import socket_path
from roboglot.programs.rehearsing import Scene
from roboglot.rehearsal import Rehearsals

OWN = "print('hello')\nimport time\ntime.sleep(600)\n"
TEST = """
import os, time
import pytest

def memory():
    with open("/proc/self/smaps_rollup") as lines:
        return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("Pss:"))

@pytest.fixture
def began():
    return time.monotonic()

@pytest.mark.world("empty")
@pytest.mark.parametrize("turn", (1, 2))
def test_it(began, robot_server, rest, turn):
    rest.get_power_status()
    with open(os.environ["FIGURES"], "a") as file:
        file.write(f"{time.monotonic() - began} {memory()}\\n")
"""
LIMIT = 0.2  # s
SOURCE = "print('hello')\n"
PATIENCE = 60.0


def memory(pid: int) -> float:
    """Return a process's share of the machine's memory, MB."""
    text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    return next(int(line.split()[1]) / 1024 for line in text.splitlines() if line.startswith("Pss:"))


def children(pid: int) -> list[int]:
    """Processes that this one has started."""
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


class Place:
    """Separate runtime folder, so that no other parent of this installation interferes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "PYTHONWARNINGS": "ignore"}
        self.socket = Path(socket_path(self.environment))

    def surroundings(self, *, warm: bool) -> dict[str, str]:
        return self.environment | {installation.WARM: "1" if warm else "0"}

    def open(self) -> float:
        """Start the parent; return the time until it listens, s."""
        began = time.monotonic()
        log = (self.folder / "parent.log").open("wb")
        command = [sys.executable, "-m", "roboglot.cli.warm.parent", str(self.socket)]
        self.parent = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log)
        while not self.socket.exists() and self.parent.poll() is None:
            time.sleep(0.01)
        return time.monotonic() - began

    def own(self, *, warm: bool) -> tuple[float, float]:
        """`program run --own` until it prints: s, MB of the process with the robot."""
        program = self.folder / "own.py"
        program.write_text(OWN)
        command = [sys.executable, "-m", "roboglot", "program", "run", str(program), "--own", "--world", "empty"]
        began = time.monotonic()
        with subprocess.Popen(command, env=self.surroundings(warm=warm), stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            process.stdout.readline()
            passed = time.monotonic() - began
            share = memory(children(self.parent.pid)[0] if warm else process.pid)
            process.terminate()
        return passed, share

    def worker(self, *, warm: bool) -> list[tuple[float, float]]:
        """First and second `robot_server` of a worker: s, MB."""
        (self.folder / "test_it.py").write_text(TEST)
        figures = self.folder / "figures"
        figures.write_text("")
        environment = self.surroundings(warm=warm) | {"FIGURES": str(figures)}
        command = [sys.executable, "-m", "pytest", "-q", "-n", "1", "-p", "no:cacheprovider", "test_it.py"]
        subprocess.run(command, env=environment, cwd=self.folder, stdout=subprocess.DEVNULL, check=True)
        first, second = (tuple(map(float, line.split())) for line in figures.read_text().splitlines())
        return [(first[0], first[1]), (second[0], second[1])]


def bare() -> tuple[float, float]:
    """Two Pythons that load nothing: s, MB (none)."""
    began = time.monotonic()
    for _ in range(2):
        subprocess.run([sys.executable, "-c", "pass"], check=True)
    return time.monotonic() - began, 0.0


async def simulated() -> list[float]:
    """*Simulate first* in a process that has played one before: s until its first news."""
    rehearsals, times, news = Rehearsals(), [], asyncio.Event()
    for _ in range(4):
        began = time.monotonic()
        news.clear()
        scene = Scene("empty", "cyberdog2")
        playing = asyncio.ensure_future(rehearsals.play(SOURCE, scene, speed=0, notice=lambda _: news.set()))
        await asyncio.wait_for(news.wait(), PATIENCE)
        times.append(time.monotonic() - began)
        await playing
    await rehearsals.close()
    return times


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--forked", action="store_true", help="leave out the cold starts")
    options, claims = parser.parse_args(), Claims()
    ways = ((True, "forked"),) if options.forked else ((False, "cold"), (True, "forked"))
    with tempfile.TemporaryDirectory() as name:
        place = Place(Path(name))
        print(f"the parent loads for {place.open():.2f} s and takes {memory(place.parent.pid):.0f} MB alone")
        figures: dict[str, list[tuple[float, float]]] = {}

        for _ in range(options.rounds):
            for warm, how in ways:
                figures.setdefault("two bare Pythons", []).append(bare())
                own, (first, second) = place.own(warm=warm), place.worker(warm=warm)
                for what, found in (
                    (f"program --own, {how}", own),
                    (f"first robot_server, {how}", first),
                    ("second robot_server", second),
                ):
                    figures.setdefault(what, []).append(found)
        place.parent.kill()
        place.parent.wait()
    for what, every in figures.items():
        times = sorted(s for s, _ in every)
        seconds, share = statistics.median(times), statistics.median(mb for _, mb in every)
        around = f"s ({times[0]:.2f} to {times[-1]:.2f}), {share:.0f} MB"
        if what.endswith(("cold", "Pythons")):
            print(f"reference: {what} {seconds:.2f} {around}")
        else:
            claims.at_most(what, seconds, LIMIT, around)
    cold, *later = asyncio.run(simulated())
    print(f"reference: the first simulation of a process that has loaded nothing {cold:.2f} s")
    claims.at_most("simulate first, later", statistics.median(later), LIMIT, "s")
    claims.finish()


if __name__ == "__main__":
    main()
