"""Cost and loss of recording: share of a core for robots with lidars, bytes a minute, seconds lost by kill -9.

scripts/bench recording [robots] [seconds] [kills]
"""

from __future__ import annotations

import asyncio
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from _claim import Claims

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.recording.reader import read_messages
from roboglot.runtime import Runtime

WRITER = """
import sys, time
from pathlib import Path
from roboglot.recording.entries import Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.redaction import Redaction
from roboglot.recording.thread import WriterThread
files = Files(Path(sys.argv[1]), Origin({"version": "0"}), Redaction(), Limits())
files.open(time.time_ns())
thread = WriterThread(files)
print("writing", flush=True)
while True:
    now = time.time_ns()
    thread.put(Entry("/a/events", "event", now, now, {"event": "Tick"}))
    time.sleep(0.002)
"""


def processor() -> float:
    """Seconds that this program has used."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


async def share(seconds: float) -> float:
    """The share of a core that is used now."""
    before, began = processor(), time.monotonic()
    await asyncio.sleep(seconds)
    return (processor() - before) / (time.monotonic() - began)


async def cost(robots: int, seconds: float, claims: Claims) -> None:
    """Processor and bytes: recording is switched on and off by turns, so that both see the same machine."""
    with tempfile.TemporaryDirectory() as folder:
        base = load_config(None, {"data": folder, "world": "office"})
        placed = with_addresses(tuple(RobotConfig(f"r{number}", "universal") for number in range(robots)))
        runtime = Runtime(replace(base, robots=placed, console=ConsoleConfig(enabled=False)))
        await runtime.start()
        await asyncio.sleep(5.0)
        differences, sizes = [], []
        for turn in range(5):
            without = await share(seconds)
            runtime.recorder.start(str(Path(folder) / f"{turn}.mcap"))
            await asyncio.sleep(1.0)
            differences.append(await share(seconds) - without)
            ended = await runtime.recorder.stop()
            assert not ended.dropped
            sizes.append(ended.bytes / ended.seconds * 60 / robots / 1e6)
        await runtime.close()
    print("turns:", *(f"{100 * one:.2f} %" for one in differences))
    claims.at_most(f"core for {robots} robots", statistics.median(differences) * 100, 2.0, "%")
    claims.at_most("a minute and robot", statistics.median(sizes), 1.0, "MB")


def losses(kills: int) -> list[float]:
    """Seconds that each killed program has lost, ten programs at a time."""
    lost: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        for batch in range(0, kills, 10):
            paths = [Path(folder) / f"{number}.mcap" for number in range(batch, min(batch + 10, kills))]
            children = [subprocess.Popen([sys.executable, "-c", WRITER, p], stdout=subprocess.PIPE) for p in paths]
            for child in children:
                assert child.stdout
                child.stdout.readline()
            for number, (path, child) in enumerate(zip(paths, children, strict=True)):
                time.sleep(1.5 if number == 0 else 0.13)
                killed = time.time_ns()
                child.kill()
                child.wait()
                lost.append((killed - max(message.at for message in read_messages(path))) / 1e9)
    return lost


def main() -> None:
    """Print the figures beside their limits."""
    robots, seconds, kills = (int(v) for v in (*sys.argv[1:], *("10", "20", "100")[len(sys.argv) - 1 :]))
    claims = Claims()
    asyncio.run(cost(robots, seconds, claims))
    if kills:
        lost = losses(kills)
        claims.at_most(f"worst of {kills} kill -9", max(lost), 1.0, "s lost")
        print(f"{'median':36} {statistics.median(lost):9.2f} s lost")
    claims.finish()


if __name__ == "__main__":
    main()
