"""Claim: a million random and mutated lines on the control port: all answered, no exception, no growth, others served.

``--lines`` and ``--seed`` choose others. The server is a real ``roboglot up`` in a separate process.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import re
import tempfile
import time
from pathlib import Path

from _claim import Claims

from roboglot.testing.process import ServedRobot, served

ADDRESS = "127.0.0.72"
SPEED = "20"  # motions that a client awaits end sooner
WRITERS = 8
BATCH = 100  # lines sent before their answers are read
WARM = 0.2  # share of the lines after which memory is measured
SEEDS = """command|quit|version|robot mode free|robot mode ?|robot battery ?|chassis speed x 0.1 y 0 z 5|chassis speed ?
chassis wheel w1 5 w2 5 w3 5 w4 5|chassis move x 0.01 z 1 vxy 0.5|chassis position ?|chassis attitude ?|chassis status ?
chassis push position on pfreq 10 attitude on status off freq 5|chassis stop|gimbal speed p 1 y 1|gimbal attitude ?
gimbal move p 1 wait_for_complete false|gimbal moveto p 1 y 1 wait_for_complete false|gimbal suspend|gimbal resume
gimbal recenter wait_for_complete false|gimbal push attitude on afreq 20|blaster bead 2|blaster bead ?|blaster fire
armor sensitivity 5|armor sensitivity ?|armor event hit on|sound event applause on|pwm value 0x3 50|pwm freq 0x3 1000
led control comp all r 1 g 2 b 3 effect blink|sensor_adapter adc id 1 port 1 ?|sensor_adapter io_level id 1 port 1 ?
sensor_adapter pulse_period id 1 port 1|sensor_adapter event io_level on|ir_distance_sensor measure on
ir_distance_sensor distance 1 ?|servo angle id 1 angle 5|servo speed id 1 speed 5|servo stop|servo angle id 1 ?
robotic_arm move x 1 y 0|robotic_arm moveto x 1 y 1|robotic_arm recenter|robotic_arm stop|robotic_arm position ?
robotic_gripper open 1|robotic_gripper close|robotic_gripper status ?|AI attribute line_color red|AI push marker off
camera exposure small|stream on|stream off|audio on|audio off|game_msg on|game_msg off""".replace("\n", "|").split("|")
WORDS = [
    *{word for seed in SEEDS for word in seed.split()},
    "seq",
    "1e999",
    "nan",
    "-0",
    "0xffffffffffffffffffff",
    "9" * 400,
]
TROUBLE = re.compile(r"Traceback|internal error|ERROR|Exception|never awaited")


def line(dice: random.Random) -> bytes:
    """Return one command's text, from flawless to noise; without ``;``."""
    match dice.randrange(5):
        case 0:
            return dice.choice(SEEDS).encode()
        case 1:
            return " ".join(dice.choices(WORDS, k=dice.randrange(1, 9))).encode()
        case 2:
            words = dice.choice(SEEDS).split()
            words[dice.randrange(len(words))] = dice.choice(WORDS)
            return f"{' '.join(words)} seq {dice.choice(['7', '0x7', 'x', '-1', ''])}".encode()
        case 3:
            text = bytearray(dice.choice(SEEDS).encode())
            for _ in range(dice.randrange(1, 5)):
                text[dice.randrange(len(text))] = dice.randrange(256)
            return bytes(text).replace(b";", b"")
        case _:
            return dice.randbytes(dice.choice([3, 20, 200, 2000])).replace(b";", b"")


async def write(address: str, lines: int, seed: int) -> tuple[int, int]:
    """Lines that want an answer, and answers."""
    dice, asked, answered = random.Random(seed), 0, 0
    reader, writer = await asyncio.open_connection(address, 40923)
    writer.write(b"command;")
    await reader.readuntil(b";")
    for _ in range(lines // BATCH):
        batch = [line(dice) for _ in range(BATCH)]
        wanted = sum(text.decode(errors="replace").strip() != "" for text in batch)
        writer.write(b";".join(batch) + b";")
        for _ in range(wanted):
            await asyncio.wait_for(reader.readuntil(b";"), 60)
            answered += 1
        asked += wanted
    writer.close()
    return asked, answered


async def watch(address: str, delays: list[float]) -> None:
    """Ask for the time of day meanwhile, as another client."""
    reader, writer = await asyncio.open_connection(address, 40923)
    try:
        while True:
            began = time.perf_counter()
            writer.write(b"version;")
            await reader.readuntil(b";")
            delays.append(time.perf_counter() - began)
            await asyncio.sleep(0.05)
    finally:
        writer.close()


async def fuzz(robot: ServedRobot, lines: int, seed: int, claims: Claims) -> None:
    delays: list[float] = []
    watcher = asyncio.ensure_future(watch(robot.address, delays))

    async def part(share: float, salt: int) -> tuple[int, int]:
        each = round(lines * share / WRITERS / BATCH) * BATCH
        counts = await asyncio.gather(*(write(robot.address, each, seed + salt + n) for n in range(WRITERS)))
        return sum(asked for asked, _ in counts), sum(answered for _, answered in counts)

    warm = await part(WARM, 0)
    memory, began, cpu = robot.resident_megabytes, time.perf_counter(), robot.cpu_seconds
    rest = await part(1 - WARM, WRITERS)
    spent, used = time.perf_counter() - began, robot.cpu_seconds - cpu
    watcher.cancel()
    print(f"{rest[0] / spent:.0f} lines/s, {used / rest[0] * 1e6:.0f} us of processor time a line")
    claims.at_most("lines without an answer", warm[0] + rest[0] - warm[1] - rest[1], 0, "lines")
    claims.at_least("lines answered", warm[1] + rest[1], lines * 0.99, "lines")
    claims.at_most("growth of memory", robot.resident_megabytes - memory, 8, "MB")
    claims.at_most("another's answer, 99th percentile", sorted(delays)[int(len(delays) * 0.99)] * 1000, 500, "ms")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--lines", type=int, default=1_000_000)
    options.add_argument("--seed", type=int, default=1)
    chosen, claims = options.parse_args(), Claims()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        arguments = ("--world", "empty", "--robot", "a=robomaster_ep", "--speed", SPEED)
        with served(Path(folder) / "data", *arguments, address=ADDRESS, log=log) as robot:
            asyncio.run(fuzz(robot, chosen.lines, chosen.seed, claims))
        trouble = [text for text in log.read_text().splitlines() if TROUBLE.search(text)]
        print(*trouble[:5], sep="\n")
        claims.at_most("exceptions in the log", len(trouble), 0, "lines")
    claims.finish()


if __name__ == "__main__":
    main()
