"""Settings for all tests: examples are the same in every run, and a slow machine is not a failure."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import fcntl
import functools
import gc
import importlib
import importlib.util
import inspect
import itertools
import logging
import os
import re
import signal
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants
from hypothesis.internal.entropy import deterministic_PRNG

from roboglot.hosting import closing, installation
from roboglot.storage.settings import StoredSettings
from tests.workers import warm_start
from tests.workers.scheduling import pytest_xdist_make_scheduler  # noqa: F401 - a hook

if TYPE_CHECKING:
    from tests.storage.postgresql_server import PostgreSQLServer

settings.register_profile("same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("explore", deadline=None, max_examples=1000)  # scripts/test --hypothesis-profile explore
settings.register_profile("quick", settings.get_profile("same"), max_examples=20)  # scripts/test --fast
settings.register_profile("some", settings.get_profile("same"), max_examples=25)  # scripts/test; --slow: all
settings.load_profile("same")

# httpx's pool tries to import it at every request: a third of a request's time was spent on a missing module.
if importlib.util.find_spec("sniffio") is None:
    sys.modules["sniffio"] = None  # type: ignore[assignment]
# jsonschema, and with it MCP, would compile its grammar, for 2 s; no schema of the tests has an IRI.
sys.modules["rfc3987_syntax"] = None  # type: ignore[assignment]

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # started in the background; tests interrupt their processes
    signal.signal(signal.SIGINT, signal.default_int_handler)

closing.CLOSE_SECONDS = 30.0  # a busy machine may close connections late; tests would find them half closed
os.environ.setdefault(installation.WARM, "0")  # no process outlives the tests, and workers are measured as they are
warm_start.install()
gc.disable()  # until all tests are collected: there is no garbage yet, and looking for it takes a sixth of that time


def pytest_configure(config: pytest.Config) -> None:
    """Keep constants of our source out of hypothesis' examples, but for ``--hypothesis-profile explore``.

    Which modules a worker has imported depends on its earlier tests, so examples would not be the same in every run;
    and reading them all takes each worker 5 s.
    """
    if config.getoption("hypothesis_profile", None) != "explore":
        providers._get_local_constants = lambda: NO_CONSTANTS


TESTS = Path(__file__).parent
TRIM_PERIOD = 50  # tests
FEW = ("quick", "some")  # profiles
OF_ITS_OWN = "_hypothesis_internal_use_settings"  # attribute of a property
NO_CONSTANTS = Constants()
PROCESSES = (
    "access",
    "browser",
    "cli",
    "cloud",
    "console",
    "docs",
    "drivers",
    "end_to_end",
    "shards",
    "workers",
)  # folders that contain some
LONGEST = (  # for a worker: what starts browsers, environments and campaigns; begun late, they would run on alone
    "tests/browser/",
    "tests/test_core_install.py",
    "tests/test_house.py",
    "tests/test_runtime.py",
    "tests/testing/test_campaign.py",
    "tests/testing/test_ci.py",
    "tests/testing/test_fixtures.py",
    "tests/testing/test_server.py",
)
WORLDS = {"world", "robot", "fleet", "door", "client", "engine", "screen"}
BUILDS_A_WORLD = re.compile(r"\b(?:World|build_fleet|Runtime|lockstep_runtime|RobotServer|serving)\(")
STARTS_A_PROCESS = re.compile(r"\b(?:subprocess\.|create_subprocess_|multiprocessing\.|Engine\(|Popen\()")
HELPERS = re.compile(r"^from (tests\.[\w.]+) import", re.MULTILINE)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import no file all of whose tests are left out: that takes longer than the rest of ``scripts/test --fast``."""
    wanted: str = config.option.markexpr
    if collection_path.suffix != ".py" or "not simulated and not process" not in wanted:
        return None
    text = _text(collection_path)
    return bool(BUILDS_A_WORLD.search(text) or STARTS_A_PROCESS.search(text)) or None


def pytest_sessionstart(session: pytest.Session) -> None:
    """Have each worker rewrite the assertions of its share of files, not every one those of all.

    The others find them in the cache. What cannot be imported is reported when it is collected.
    """
    worker: dict[str, Any] = getattr(session.config, "workerinput", {})
    if not worker or not all((TESTS.parent / argument).is_dir() for argument in session.config.args):
        return
    files = sorted(file for argument in session.config.args for file in (TESTS.parent / argument).rglob("test_*.py"))
    for file in files[int(worker["workerid"].removeprefix("gw")) :: worker["workercount"]]:
        if file.is_relative_to(TESTS) and not pytest_ignore_collect(file, session.config):
            with contextlib.suppress(Exception, pytest.skip.Exception):
                importlib.import_module(".".join(file.relative_to(TESTS.parent).with_suffix("").parts))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item], config: pytest.Config) -> None:
    """Put what takes a worker longest first. Set the markers that follow from a test's place and its fixtures.

    Those only for a choice that asks for them: each worker would read all tests for nothing.
    """
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))
    if (profile := config.getoption("hypothesis_profile", None)) in FEW:
        for item in items:
            take_few_examples(getattr(item, "obj", None), settings.get_profile(profile).max_examples)
    if not {"process", "simulated"} & set(re.findall(r"\w+", config.option.markexpr)):
        return
    for item in items:
        folder = item.path.relative_to(TESTS).parts[0]
        if folder in PROCESSES or folder.endswith(".py"):
            item.add_marker("process")
        traits = set.union(_file_traits(item.path), *map(_traits, _fixtures(item)))
        if WORLDS & set(getattr(item, "fixturenames", ())):
            traits.add("simulated")
        for trait in sorted(traits):
            item.add_marker(trait)


def take_few_examples(test: object, most: int) -> None:
    """Have a property of Hypothesis with a number of examples of its own take ``most`` of them.

    ``scripts/test --slow`` takes all.
    """
    own = getattr(test, OF_ITS_OWN, None)
    if isinstance(own, settings) and own.max_examples > most:
        setattr(getattr(test, "__func__", test), OF_ITS_OWN, settings(own, max_examples=most))


def _fixtures(item: pytest.Item) -> set[Callable[..., object]]:
    """Return the functions of ours that make a test's fixtures."""
    known = getattr(getattr(item, "_fixtureinfo", None), "name2fixturedefs", {})
    made_by = {definition.func for definitions in known.values() for definition in definitions}
    return {function for function in made_by if function.__module__.startswith("tests.")}


@functools.cache
def _file_traits(path: Path) -> set[str]:
    """Return the marks of a file of tests, by itself and the helpers that it imports."""
    text = _text(path)
    helpers = [TESTS.parent / f"{name.replace('.', '/')}.py" for name in HELPERS.findall(text)]
    texts = [text, *(_text(helper) for helper in helpers if helper.name != "conftest.py" and helper.is_file())]
    return set.union(*map(_traits_of, texts))


@functools.cache
def _traits(function: Callable[..., object]) -> set[str]:
    return _traits_of(inspect.getsource(function))


def _traits_of(source: str) -> set[str]:
    simulated, process = BUILDS_A_WORLD.search(source), STARTS_A_PROCESS.search(source)
    return {trait for trait, found in (("simulated", simulated), ("process", process)) if found}


@functools.cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def pytest_collection_finish() -> None:
    """Leave all that was loaded out of garbage collections: it stays. What is garbage of it is not worth a look."""
    gc.freeze()
    with deterministic_PRNG():  # its first use looks through all objects, twice: up to 6 s after many tests
        pass
    gc.enable()
    gc.set_threshold(5_000, 5, 5)  # a world is thousands of objects that end together


_tests_ended = itertools.count(1)
_trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's


def pytest_runtest_logfinish() -> None:
    """Return free memory to the system now and then: robots have it kept, and four workers would hold gigabytes."""
    if _trim is not None and next(_tests_ended) % TRIM_PERIOD == 0:
        _trim(0)


@pytest.fixture(scope="session")
def running_db_server() -> Iterator[PostgreSQLServer]:
    """One PostgreSQL server for all tests of a worker."""
    from tests.storage.postgresql_server import binary_folder, postgresql_server

    binaries = binary_folder()
    assert binaries
    with postgresql_server(binaries) as running:
        yield running


@pytest.fixture
def db_server(running_db_server: PostgreSQLServer) -> PostgreSQLServer:
    """Return a PostgreSQL server with an empty database."""
    running_db_server.empty()
    return running_db_server


VENDOR_PORTS = (40924, 40926)  # UDP
OTHER_TESTS = "other tests hold the ports of RoboMaster clients"
TURN = 180.0  # real s for other tests, of the 240 that a test may take
STRANGERS = 60.0  # real s for clients of other programs
PAUSE = 0.1  # real s between two looks
_strangers_stay: list[str] = []  # for whose sake tests were skipped: later ones wait 1 s


@pytest.fixture
def caplog(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    """Log of the test, without what robots that other tests keep in a thread log meanwhile, as of a slow machine."""
    caplog.handler.addFilter(_is_of_this_test)
    return caplog


def _is_of_this_test(record: logging.LogRecord) -> bool:
    return record.threadName != "roboglot"  # see roboglot.testing.server


@pytest.fixture
def slow_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let settings be stored some steps of the loop later, as in a database's thread."""
    put_all = StoredSettings.put_all

    async def put_later(store: StoredSettings, values: Mapping[str, object]) -> None:
        for _ in range(5):
            await asyncio.sleep(0)
        await put_all(store, values)

    monkeypatch.setattr(StoredSettings, "put_all", put_later)


@pytest.fixture
def vendor_ports() -> Iterator[None]:
    """RoboMaster clients bind these ports on every address of the machine: one test at a time may have them.

    No test keeps its turn while another program holds them: the others' waits would add up.
    """
    with (Path(tempfile.gettempdir()) / "roboglot-tests-vendor-ports.lock").open("w") as lock:
        begun, strangers = time.monotonic(), 0.0
        while reason := reason_to_wait(lock, VENDOR_PORTS):
            strangers += PAUSE * (reason != OTHER_TESTS)
            if time.monotonic() - begun > TURN or strangers > (1.0 if _strangers_stay else STRANGERS):
                _strangers_stay.extend([] if reason == OTHER_TESTS else [reason])
                pytest.skip(f"{reason} on this machine")
            time.sleep(PAUSE)
        yield


def reason_to_wait(lock: IO[str], ports: Sequence[int]) -> str:
    """Take the turn; where that cannot be, return why."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return OTHER_TESTS
    if taken := [port for port in ports if not _free(port)]:
        fcntl.flock(lock, fcntl.LOCK_UN)
        return f"another client of the text protocol holds UDP {taken}"
    return ""


def _free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True
