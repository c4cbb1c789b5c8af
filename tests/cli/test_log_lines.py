"""Log lines name their robot, and at the limit of open files there is a sentence."""

from __future__ import annotations

import asyncio
import errno
import logging
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import uvloop

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.hosting.logs import LINES_MAX, PERIOD, BoundsLines, HidesQueries, NamesRobot, in_shape
from roboglot.hosting.open_files import OpenFiles, ran_out
from roboglot.model.client_context import concerned, concerning
from roboglot.model.clock import LockstepClock
from roboglot.shards.actor import _Lines
from roboglot.simulation.bodies.schedule import Job, Schedule
from roboglot.simulation.world.world import TICK
from roboglot.storage.database import Database

LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (24, 24))
sys.argv = ["roboglot", "up", "--data", sys.argv[1], *(f"--robot=r{n}=universal" for n in range(1))]
from roboglot.cli import main
main()
"""


def line(text: str, *args: object) -> str:
    record = logging.LogRecord("roboglot.x", logging.INFO, "x.py", 1, text, args, None)
    assert NamesRobot().filter(record)
    return record.getMessage()


def test_a_line_about_a_robot_names_it() -> None:
    assert line("%d: %s", 1004, "no") == "1004: no"
    with concerning("b"):
        assert line("%d: %s", 1004, "100 %") == "robot b: 1004: 100 %"
        assert line("robot %s said: %s", "b", "hi") == "robot b said: hi"
    assert line("plain") == "plain"


def test_lines_of_a_cluster_have_the_same_form() -> None:
    lines = _Lines()
    in_shape(lines)
    with concerning("b"):
        lines.handle(logging.LogRecord("roboglot.x", logging.WARNING, "x.py", 1, "%s", ("hi\x1b[2J",), None))
    (shown,) = lines.kept
    assert "WARNING robot b: hi" in shown
    assert "\x1b" not in shown


@pytest.mark.parametrize(
    ("logger", "text", "args", "shown"),
    [
        (
            "uvicorn.error",
            '%s - "WebSocket %s" [accepted]',
            ("127.0.0.1:4", "/live?token=rg-1&x=a%20b"),
            '127.0.0.1:4 - "WebSocket /live?…" [accepted]',
        ),
        (
            "httpx",
            'HTTP Request: %s %s "%s"',
            ("GET", "http://x/y?key=1", "200 OK"),
            'HTTP Request: GET http://x/y?… "200 OK"',
        ),
        ("websockets.server", "opened %s", ("/?token=1",), "opened /?…"),
        ("uvicorn.error", "ready?", (), "ready?"),
        ("roboglot.x", "what is %s", ("/a?b=c",), "what is /a?b=c"),  # our own lines name no queries
    ],
)
def test_lines_of_libraries_hide_query_strings(logger: str, text: str, args: tuple[object, ...], shown: str) -> None:
    """They may hold a token, the code of a class or a password."""
    record = logging.LogRecord(logger, logging.INFO, "x.py", 1, text, args, None)
    assert HidesQueries().filter(record)
    assert record.getMessage() == shown


class Asked(asyncio.Protocol):
    """Says of which robot its door is."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport) or hasattr(transport, "write")
        transport.write(concerned().encode())
        transport.close()


QUIET = """
import logging
from roboglot.hosting.logs import set_up_logging
set_up_logging(False)
for name in ("aioice.ice", "psycopg.pool", "mcp.server", "roboglot.x", "my_driver"):
    logging.getLogger(name).info("a line of %s", name)
    logging.getLogger(name).warning("a warning of %s", name)
"""


def test_libraries_write_warnings_only() -> None:
    """A camera's call over WebRTC wrote a dozen lines about ICE candidates."""
    run = subprocess.run([sys.executable, "-c", QUIET], capture_output=True, text=True, timeout=60, check=True)
    assert run.stderr.count("a warning of") == 5
    assert {line.split()[5] for line in run.stderr.splitlines() if " INFO " in line} == {"roboglot.x", "my_driver"}


@pytest.mark.parametrize("run", [asyncio.run, uvloop.run])
def test_connections_belong_to_their_doors_robot(run: object) -> None:
    async def answers() -> list[bytes]:
        servers = []
        for name in ("a", "b"):
            with concerning(name):
                servers.append(await asyncio.get_running_loop().create_server(Asked, "127.0.0.1", 0))
        heard = []
        for server in servers:
            reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
            heard.append(await reader.read())
            writer.close()
            server.close()
        return heard

    assert callable(run)
    assert run(answers()) == [b"a", b"b"]


def test_too_few_files_is_one_sentence(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, str(tmp_path)], capture_output=True, text=True, check=False, timeout=100
    )
    assert done.returncode == 1
    assert done.stderr.startswith("roboglot up: 2 robots need 86 open files, and this program may have 24: ")
    assert done.stderr.count("\n") == 1


def test_unusable_data_folder_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    command = [sys.executable, "-m", "roboglot", "up", "--data", str(folder := tmp_path / "file/data")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 1
    assert done.stderr == f"roboglot up: {folder}: Not a directory; choose another folder with --data\n"


def test_running_out_of_files_is_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    loop = asyncio.new_event_loop()
    try:
        files = OpenFiles()
        for _ in range(3):
            files.explain(loop, {"message": "accept", "exception": OSError(errno.EMFILE, "Too many open files")})
    finally:
        loop.close()
    assert [record.getMessage()[:25] for record in caplog.records] == ["dropping new connections:"]
    assert not ran_out(OSError(errno.ECONNRESET, ""))


async def test_world_events_are_logged_with_their_robot() -> None:
    database, clock = Database(":memory:"), LockstepClock()
    fleet = build_fleet("empty", [RobotConfig(name="a"), RobotConfig(name="b")], clock=clock, seed=1, database=database)
    heard: dict[str, set[str]] = {}

    def hear(*_: float, place: str) -> None:
        heard.setdefault(place, set()).add(concerned())
        if not place.startswith("timer"):
            clock.call_later(0.1, partial(hear, place=f"timer of {place}"))

    for name, simulated in fleet.world._population.simulated.items():
        control, sense = (Job(partial(hear, place=f"{part} of {name}")) for part in ("control", "senses"))
        simulated.controls = Schedule([*simulated.controls._jobs, control], TICK)
        simulated.senses = Schedule([*simulated.senses._jobs, sense], TICK)
    await fleet.start(wait=True)
    await clock.advance(0.3)
    await fleet.close()
    database.close()
    assert heard == {
        f"{when}{part} of {name}": {name}
        for name in ("a", "b")
        for part in ("control", "senses")
        for when in ("", "timer of ")
    }


def test_flood_of_lines_is_bounded_and_counted() -> None:
    now = 0.0
    heard: list[str] = []
    log = logging.getLogger("flood")

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            heard.append(record.getMessage())

    handler = Ear()
    handler.addFilter(BoundsLines(lambda: now))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        with concerning("a"):
            for number in range(300):
                log.info("%d connected", number)
            log.info("another kind")
            assert len(heard) == LINES_MAX + 1
            assert heard[LINES_MAX - 1] == "49 connected; further lines like this are left out for up to 10 s"
            now = PERIOD
            log.info("%d connected", 300)
        assert heard[-1] == "300 connected; 250 lines like this were left out before"
        with concerning("b"):
            log.info("%d connected", 301)
        assert heard[-1] == "301 connected"
        for number in range(100):  # at a start, a line for each robot
            log.info("robot %d stands", number)
        assert len(heard) == LINES_MAX + 3 + 100
    finally:
        log.removeHandler(handler)
