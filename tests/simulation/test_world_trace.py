"""Same seed, same trace, byte for byte, in different processes."""

import asyncio
import os
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
SECONDS = 12  # the lift that is called after three has arrived by then


async def digests(hash_seed: str, *worlds: str) -> list[list[bytes]]:
    """Return what the robots sensed until each second, in each of the worlds of a process."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "tests.simulation.trace",
        *worlds,
        stdout=asyncio.subprocess.PIPE,
        cwd=PROJECT,
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
    )
    try:
        output, _ = await process.communicate()  # a hung one ends with the test, at pytest's limit
    finally:
        if process.returncode is None:
            process.kill()
    assert process.returncode == 0
    return [line.split() for line in output.splitlines()]


@pytest.mark.slow  # in short: test_the_same_seed_sees_the_same
async def test_processes_sense_the_same_other_seeds_differ():
    long = f"7:{SECONDS}"
    (first, other), (second,) = await asyncio.gather(digests("1", long, "8:1"), digests("2", long))
    assert [len(digest) for digest in first] == [64] * SECONDS
    assert first == second
    assert first[0] != other[0]
