"""Same seed, same trace, byte for byte, in different processes."""

import asyncio
import os
import sys
from pathlib import Path

PROJECT = Path(__file__).parents[2]


async def digest(seed: int, hash_seed: str) -> bytes:
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "tests.simulation.trace",
        str(seed),
        stdout=asyncio.subprocess.PIPE,
        cwd=PROJECT,
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
    )
    try:
        async with asyncio.timeout(100):
            output, _ = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
    assert process.returncode == 0
    return output.strip()


async def test_processes_sense_the_same_other_seeds_differ():
    first, second, other = await asyncio.gather(digest(7, "1"), digest(7, "2"), digest(8, "1"))
    assert len(first) == 64
    assert first == second
    assert first != other
