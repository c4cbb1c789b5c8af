"""pytest fixtures, loaded by pytest itself (entry point); docs/testing.md.

Real ports: ``robot_server``, and its clients ``rest``, ``robomaster``, ``cyberdog``, ``program``. In-process and in
lockstep, for asyncio tests: ``clock``, ``forward``, ``fleet``, ``world``, ``robot``. Markers: ``world``, ``body``,
``seed``, ``fault``, ``recording``. A failed test leaves its recording, a picture of the map and the exchanges.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import sys
from collections.abc import AsyncIterator, Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
    from roboglot.testing.blocking import Blocking
    from roboglot.testing.case import RobotTestCase
    from roboglot.testing.requirements import Wanted
    from roboglot.testing.server import RobotServer

MARKERS = (
    "world(name, robots=('a',), body='universal', seed=1, speed=4.0, lockstep=False, shared=False, doors={}):"
    " the world of the roboglot fixtures; those after seed are robot_server's",
    "body(name): the robots' body",
    "seed(number): of everything that chance decides",
    "fault(kind, robot=None, **options): a fault that acts from the start of the test; any number of them",
    "recording(file): the robots of robot_server answer as in that recording",
)
OPTION = "--roboglot-failures"
_COMPILED = pytest.StashKey[bool]()
_SERVER = pytest.StashKey["RobotServer"]()
_SHARED = pytest.StashKey[dict["Wanted", "RobotServer"]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    from roboglot.testing.artifacts import FOLDER

    group = parser.getgroup("roboglot")
    group.addoption(OPTION, default=FOLDER, metavar="DIR", help="where failed tests leave recordings, maps, exchanges")


def pytest_configure(config: pytest.Config) -> None:
    for line in MARKERS:
        config.addinivalue_line("markers", line)


@pytest.hookimpl(tryfirst=True)
def pytest_load_initial_conftests(early_config: pytest.Config) -> None:
    """Keep pytest from rewriting roboglot's asserts.

    It would rewrite every module of a package with a plugin: 800 here, seconds at each start, without benefit.
    """
    hook = getattr(early_config.pluginmanager, "rewrite_hook", None)
    marked = getattr(hook, "_must_rewrite", None)  # no public API; without it, the start only takes longer
    if hook is not None and isinstance(marked, set):
        marked.discard("roboglot")
        marked.add("roboglot.testing")  # to pytest < 9.2 an editable one is imported too early, and it would warn
        hook.mark_rewrite()  # forgets what it decided before


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(specs: list[object]) -> None:
    """Start pytest-xdist's local workers in forks of the warm parent, which have everything imported."""
    from roboglot.cli.warm import command
    from roboglot.hosting import installation

    if not installation.is_wanted(os.environ):
        return
    import execnet

    python = shlex.join([sys.executable, "-m", command.__name__])
    for number, spec in enumerate(specs):
        if getattr(spec, "popen", None) and not getattr(spec, "python", None):
            specs[number] = warm = execnet.XSpec(f"{spec}//python={python}")
            warm.id = getattr(spec, "id", None)


@pytest.fixture
def clock() -> LockstepClock:
    """A clock that stands still until ``forward``."""
    from roboglot.model.clock import LockstepClock

    return LockstepClock()


@pytest.fixture
def forward(clock: LockstepClock) -> Forward:
    """``await forward(seconds=3)``: advance robot time; little real time passes."""

    async def pass_time(*, seconds: float) -> None:
        await clock.advance(seconds)

    return pass_time


def _compile_kernels(config: pytest.Config) -> None:
    """Compile missing kernels at the first start after an installation, with a line for each."""
    from roboglot.kernels.ahead import compile_ahead, missing

    if config.stash.get(_COMPILED, False) or not missing():
        config.stash[_COMPILED] = True  # a look takes 1 ms, and each test would take one
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

    wanted = _wanted(request)
    robots = [RobotConfig(name=robot, body=wanted.body) for robot in wanted.robots]
    _compile_kernels(request.config)
    database = Database(":memory:")
    built = build_fleet(wanted.world, robots, clock=clock, seed=wanted.seed, database=database)
    await built.start(wait=True)
    for fault in wanted.faults:
        built.world.stage.inject_fault(fault.kind, fault.robot, **dict(fault.options))
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


def _wanted(request: pytest.FixtureRequest) -> Wanted:
    from roboglot.testing.requirements import wanted_by

    try:
        return wanted_by(request.node.iter_markers())
    except (ValueError, IndexError) as error:
        raise pytest.UsageError(f"{request.node.nodeid}: a marker of roboglot: {error}") from None


# -- on real ports --


@pytest.fixture
def robot_server(request: pytest.FixtureRequest) -> Iterator[RobotServer]:
    """Robots with all their doors on real ports, each at its own loopback address; new for each test.

    With ``@pytest.mark.world(shared=True)``, tests of a session with equal requirements share a server, reset between.
    """
    from roboglot.testing.server import RobotServer

    wanted = _wanted(request)
    _compile_kernels(request.config)
    if not wanted.shared:
        with RobotServer(wanted) as server:
            request.node.stash[_SERVER] = server
            yield server
        return
    servers = request.session.stash.setdefault(_SHARED, {})
    kept: RobotServer | None = servers.get(wanted.place)
    if kept is None:
        kept = servers[wanted.place] = RobotServer(wanted).start()
    else:
        kept.prepare(wanted)
    request.node.stash[_SERVER] = kept
    yield kept


@pytest.fixture
def reset(robot_server: RobotServer) -> Callable[[], None]:
    """``reset()`` restores robots and world to the start of the test, without the faults of its markers."""
    return robot_server.reset


@pytest.fixture
def rest(robot_server: RobotServer) -> Blocking:
    """A blocking client of the first robot's REST API (``SlamwareClient``)."""
    return robot_server.clients.open(robot_server.clients.new_rest())


@pytest.fixture
def robomaster(robot_server: RobotServer) -> Blocking:
    """A blocking client of the first robot's text protocol (``RoboMasterClient``), in SDK mode."""
    return robot_server.clients.open(robot_server.clients.new_robomaster())


@pytest.fixture
def cyberdog(robot_server: RobotServer) -> Blocking:
    """A blocking client of the first robot's app protocol (``CyberDogClient``), over TLS."""
    return robot_server.clients.open(robot_server.clients.new_cyberdog())


@pytest.fixture
def program(robot_server: RobotServer) -> Blocking:
    """A blocking client of the first robot's block programs (``ProgramClient``)."""
    return robot_server.clients.open(robot_server.clients.new_program())


def pytest_sessionfinish(session: pytest.Session) -> None:
    for server in session.stash.get(_SHARED, {}).values():
        server.close()


# -- files left by failed tests --


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> None:
    """Tell a ``RobotTestCase`` pytest's folder; it saves its artifacts itself, while its robot is up."""
    case = _case(item)
    if case is not None:
        case.leave = _root(item)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed and report.when != "teardown":
        server, case = item.stash.get(_SERVER, None), _case(item)
        if server is not None:
            _attach(item, report, _save(item, report, server))
        elif case is not None:
            _attach(item, report, case.artifacts)
    return report


def _case(item: pytest.Item) -> RobotTestCase | None:
    """Return the test's ``RobotTestCase``, if it is a method of one."""
    if "roboglot.testing.case" not in sys.modules:
        return None
    from roboglot.testing.case import RobotTestCase

    case = getattr(item, "instance", None)
    return case if isinstance(case, RobotTestCase) else None


def _root(item: pytest.Item) -> Path:
    folder: str = item.config.getoption(OPTION)
    return item.config.rootpath / folder


def _save(item: pytest.Item, report: pytest.TestReport, server: RobotServer) -> Sequence[Path]:
    """Save artifacts while the robot is still up."""
    from roboglot.testing.artifacts import folder_of, save

    return save(server, folder_of(_root(item), item.nodeid), item.nodeid, report.longreprtext)


def _attach(item: pytest.Item, report: pytest.TestReport, saved: Sequence[Path]) -> None:
    """List artifacts in the report, and in its properties for JUnit."""
    report.sections.append(("roboglot", "\n".join(f"[[ATTACHMENT|{path}]]" for path in saved)))
    item.user_properties += [(f"roboglot.{path.stem}", str(path)) for path in saved]
