"""Same seed, same trace, byte for byte, in different processes."""

import asyncio
import os
import sys
from pathlib import Path

PROGRAM = Path(__file__).with_name("trace.py")


async def digest(seed: int, hash_seed: str) -> bytes:
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        str(PROGRAM),
        str(seed),
        stdout=asyncio.subprocess.PIPE,
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
