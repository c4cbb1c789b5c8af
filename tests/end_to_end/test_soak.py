"""A long life in short, through the doors: closed connections and finished programs keep nothing.

``benchmarks/robots/soak.py`` is the long one, with every kind of action.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import soak

ROUNDS, SETTLED = 4, 1  # the first rounds fill caches and histories
CONNECTIONS, PROGRAMS = 12, 3  # a round
GROWTH_MAX = 1.002  # of 200,000 objects: a round may keep 200, about ten per connection and program


@pytest.mark.slow  # many rounds in real time; benchmarks/robots/soak.py has the long run
async def test_connections_and_programs_keep_nothing(tmp_path: Path) -> None:
    objects, descriptors = [], []
    async with soak.born(tmp_path) as life:
        for _ in range(ROUNDS):
            for _ in range(CONNECTIONS):
                await life.connect()
            for _ in range(PROGRAMS):
                await life.program()
            await life.new_map()
            objects.append(soak.objects())
            descriptors.append(len(os.listdir("/proc/self/fd")))
    assert descriptors[-1] <= descriptors[SETTLED]
    assert objects[-1] <= objects[SETTLED] * GROWTH_MAX, objects
