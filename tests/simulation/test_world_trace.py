"""Same seed, same trace, byte for byte, in different processes."""

import asyncio
import os
import sys
from pathlib import Path

PROJECT = Path(__file__).parents[2]
SECONDS = 12  # the lift that is called after three has arrived by then


async def digests(seed: int, hash_seed: str, seconds: int) -> list[bytes]:
    """Return what the robots sensed until each second."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "tests.simulation.trace",
        str(seed),
        str(seconds),
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
    return output.split()


async def test_processes_sense_the_same_other_seeds_differ():
    first, second, other = await asyncio.gather(digests(7, "1", SECONDS), digests(7, "2", SECONDS), digests(8, "1", 1))
    assert [len(digest) for digest in first] == [64] * SECONDS
    assert first == second
    assert first[0] != other[0]
