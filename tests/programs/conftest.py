"""The engine fixture of the program tests."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

import pytest
import pytest_asyncio

from roboglot.programs.engine import engine as engine_module
from roboglot.programs.engine.engine import Engine


@pytest.fixture(scope="module", autouse=True)
def patient() -> Iterator[None]:
    """Wait longer for programs: they have the lowest priority, and minutes on a busy machine are seconds to them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine_module, "ANSWER_MAX", 200.0)
        yield


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def engine() -> AsyncIterator[Engine]:
    """One engine for a test module; its tests run on the module's loop."""
    async with Engine() as engine:
        yield engine
