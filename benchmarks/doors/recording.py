"""Cost and loss of recording: share of a core for robots with lidars, bytes a minute, seconds lost by kill -9.

scripts/bench recording [robots] [seconds a turn] [kills]: 80 s as it is; 100 kills take two minutes more.
"""

from __future__ import annotations

import asyncio
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path

from _claim import Claims

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.recording.reader import read_messages
from roboglot.runtime import Runtime

TURNS = 9
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


async def share(seconds: float) -> float:
    """Return the share of a core that is used now."""
    before, began = time.process_time(), time.monotonic()
    await asyncio.sleep(seconds)
    return (time.process_time() - before) / (time.monotonic() - began)


async def cost(robots: int, seconds: float, claims: Claims) -> None:
    """Processor time and bytes; recording is switched on and off in turns, so that both see the same machine."""
    with tempfile.TemporaryDirectory() as folder:
        base = load_config(None, {"data": folder, "world": "office"})
        placed = with_addresses(tuple(RobotConfig(f"r{number}", "universal") for number in range(robots)))
        runtime = Runtime(replace(base, robots=placed, console=ConsoleConfig(enabled=False)))
        await runtime.start()
        await asyncio.sleep(5.0)
        differences, sizes = [], []
        without = await share(seconds)
        for turn in range(TURNS):
            path = Path(folder) / f"{turn}.mcap"
            runtime.recorder.start(str(path))
            await asyncio.sleep(1.0)
            (writer,) = (thread for thread in threading.enumerate() if thread.name == "recorder")
            clock = time.pthread_getcpuclockid(writer.ident or 0)
            written, began = time.clock_gettime(clock), time.monotonic()
            recorded = await share(seconds)
            written = (time.clock_gettime(clock) - written) / (time.monotonic() - began)
            ended = await runtime.recorder.stop()
            assert not ended.dropped
            before, without = without, await share(seconds)
            differences.append(100 * (recorded - (before + without) / 2))
            sizes.append(ended.bytes / ended.seconds * 60 / robots / 1e6)
            print(
                f"turn {turn + 1}: {100 * before:5.2f} -> {100 * recorded:5.2f} -> {100 * without:5.2f} % of a core, "
                f"recording {differences[-1]:5.2f}, its thread alone {100 * written:.2f}",
                flush=True,
            )
        await runtime.close()
    noise = statistics.stdev(differences) / TURNS**0.5
    print(f"recording: mean {statistics.fmean(differences):.2f} %, standard error {noise:.2f}")
    claims.at_most(f"core for {robots} robots, median", statistics.median(differences), 2.0, "%")
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
    robots, seconds, kills = (int(v) for v in (*sys.argv[1:], *("10", "3", "0")[len(sys.argv) - 1 :]))
    claims = Claims()
    asyncio.run(cost(robots, seconds, claims))
    if kills:
        lost = losses(kills)
        claims.at_most(f"worst of {kills} kill -9", max(lost), 1.0, "s lost")
        print(f"{'median':36} {statistics.median(lost):9.2f} s lost")
    claims.finish()


if __name__ == "__main__":
    main()
