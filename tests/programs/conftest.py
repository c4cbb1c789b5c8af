"""The engine fixture of the program tests."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest_asyncio

from roboglot.programs.engine.engine import Engine


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def engine() -> AsyncIterator[Engine]:
    """One engine for a test module; its tests run on the module's loop."""
    async with Engine() as engine:
        yield engine
