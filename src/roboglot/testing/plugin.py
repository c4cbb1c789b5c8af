"""pytest fixtures: ``clock``, ``forward``, ``fleet``, ``world``, ``robot``. Loaded by pytest itself (entry point).

``@pytest.mark.world(name_or_path, robots=("a", "b"), body="universal", seed=3)`` chooses another world, more robots,
another body, another seed. Needs pytest-asyncio (``pip install 'roboglot[testing]'``).
"""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any

import pytest

try:
    from pytest_asyncio import fixture as async_fixture
except ImportError:  # roboglot is installed without its test extras
    async_fixture = pytest.fixture  # type: ignore[assignment]

if TYPE_CHECKING:
    from roboglot.fleet import Fleet
    from roboglot.model.clock import LockstepClock
    from roboglot.model.robot import Robot
    from roboglot.simulation.world.world import World
    from roboglot.testing import Forward


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "world(name, robots=('a',), body='universal', seed=1): the world of the roboglot fixtures"
    )


@pytest.hookimpl(tryfirst=True)
def pytest_load_initial_conftests(early_config: pytest.Config) -> None:
    """Have pytest leave roboglot's asserts alone.

    It would rewrite every module of a package that brings a plugin: 800 here, seconds at each start, for nothing.
    """
    hook: Any = getattr(early_config.pluginmanager, "rewrite_hook", None)
    marked = getattr(hook, "_must_rewrite", None)  # there is no public way; without it, it only takes longer
    if isinstance(marked, set):
        marked.discard("roboglot")
        hook.mark_rewrite("roboglot.testing")


@pytest.fixture
def clock() -> LockstepClock:
    """A clock that stands still until ``forward``."""
    from roboglot.model.clock import LockstepClock

    return LockstepClock()


@pytest.fixture
def forward(clock: LockstepClock) -> Forward:
    """``await forward(seconds=3)``: robot time passes, real time hardly."""

    async def pass_time(*, seconds: float) -> None:
        await clock.advance(seconds)

    return pass_time


def _compile_kernels(config: pytest.Config) -> None:
    """Compile what is not compiled yet, the first time after an installation, with a line for each kernel."""
    from roboglot.kernels.ahead import compile_ahead, missing

    if not missing():
        return
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    capture = config.pluginmanager.get_plugin("capturemanager")

    def report(name: str, done: int, total: int) -> None:
        if reporter is not None:
            reporter.write_line(f"roboglot: compiled kernel {done} of {total}: {name}")

    with capture.global_and_fixture_disabled() if capture else contextlib.nullcontext():
        compile_ahead(report=report)


@async_fixture
async def fleet(request: pytest.FixtureRequest, clock: LockstepClock) -> AsyncIterator[Fleet]:
    """The world with its robots, started, at time 0."""
    from roboglot.config import RobotConfig
    from roboglot.fleet import build_fleet
    from roboglot.storage.database import Database

    marker = request.node.get_closest_marker("world")
    name = marker.args[0] if marker and marker.args else "office"
    options = marker.kwargs if marker else {}
    body = options.get("body", "universal")
    robots = [RobotConfig(name=robot, body=body) for robot in options.get("robots", ("a",))]
    _compile_kernels(request.config)
    database = Database(":memory:")
    built = build_fleet(name, robots, clock=clock, seed=options.get("seed", 1), database=database)
    await built.start(wait=True)
    yield built
    await built.close()
    database.close()


@pytest.fixture
def world(fleet: Fleet) -> World:
    """The simulated world: the truth, for assertions."""
    return fleet.world


@pytest.fixture
def robot(fleet: Fleet) -> Robot:
    """The first robot."""
    return next(iter(fleet.robots.values()))
