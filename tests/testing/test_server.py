"""Real ports for users' tests: each protocol's ready-made client, markers, reset, lockstep, and what failures leave."""

from __future__ import annotations

import asyncio
import contextlib
import re
import subprocess
import sys
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar
from xml.etree import ElementTree

import pytest

from roboglot.config import Config, RobotConfig
from roboglot.extras import MissingExtra
from roboglot.model.geometry import Pose
from roboglot.recording.reader import read_recording
from roboglot.testing.blocking import Loop
from roboglot.testing.case import RobotTestCase
from roboglot.testing.clients import Clients
from roboglot.testing.server import RobotServer
from roboglot.wire.slamware.chapters.motion import MoveOptions, MoveToOptions
from roboglot.wire.slamware.geometry import Location

PROGRAM = "cyberdog.task.block('one');\nprint('hello')\ncyberdog.task.block('two');\n"


@pytest.mark.world("empty")
def test_a_robot_is_driven_by_rest(robot_server: RobotServer, rest: Any) -> None:
    rest.begin("MoveToAction", MoveToOptions(Location(0.5, 0.0), MoveOptions())).wait()
    assert robot_server.moved().x == pytest.approx(0.5, abs=0.15)
    assert "slamware" in {exchange.door for exchange in robot_server.exchanges}


@pytest.mark.world("empty")
def test_a_robot_is_driven_by_text(robot_server: RobotServer, robomaster: Any) -> None:
    robomaster.chassis.move(x=0.4, wait=True)
    assert robot_server.moved().x == pytest.approx(0.4, abs=0.1)
    assert robomaster.chassis.get_position().x == pytest.approx(0.4, abs=0.1)


@pytest.mark.world("empty")
def test_a_dog_calls_its_app_back(cyberdog: Any) -> None:
    assert cyberdog.found() is not None
    assert cyberdog.connected


@pytest.mark.world("empty")
def test_missing_packages_of_doors_have_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """With ``roboglot[testing]`` alone, a test with real ports failed with a bare "No module named 'grpc'"."""

    async def start(*_: object) -> None:
        raise ModuleNotFoundError("No module named 'grpc'", name="grpc")

    monkeypatch.setattr(RobotServer, "_start", start)
    with pytest.raises(MissingExtra, match=r"grpc, which is not installed: pip install 'roboglot\[up\]'"):
        RobotServer().start()


def test_program_client_returns_blocks_and_output(program: Any) -> None:
    run = program.run(PROGRAM)
    assert run.blocks == ["one", "two"]
    assert run.printed == ["hello"]


@pytest.mark.world("empty", robots=("a", "b"), body="hermes", lockstep=True)
@pytest.mark.seed(5)
def test_lockstep_time_stands_until_the_test_releases_it(robot_server: RobotServer, rest: Any) -> None:
    assert robot_server.runtime.config.seed == 5
    before = robot_server.time
    rest.begin("MoveToAction", MoveToOptions(Location(0.6, 0.0), MoveOptions()))
    assert robot_server.time == before
    robot_server.forward(15.0)
    assert robot_server.time == pytest.approx(before + 15.0)
    assert robot_server.moved("a").x == pytest.approx(0.6, abs=0.15)
    assert robot_server.moved("b").x == 0.0


@pytest.mark.world("empty")
@pytest.mark.fault("lidar_gone")
def test_a_fault_acts_from_the_start_until_reset(robot_server: RobotServer, reset: Callable[[], None]) -> None:
    assert [fault.kind for fault in robot_server.stage.faults] == ["lidar_gone"]
    reset()
    assert not robot_server.stage.faults


class TestShared:
    """One server for both; what the first one does is gone for the second."""

    servers: ClassVar[set[int]] = set()

    @pytest.mark.world("empty", shared=True)
    @pytest.mark.parametrize("_run", range(2))
    def test_it_starts_where_it_started(self, robot_server: RobotServer, rest: Any, _run: int) -> None:
        self.servers.add(id(robot_server))
        assert len(self.servers) == 1
        assert robot_server.moved().x == pytest.approx(0.0, abs=0.02)
        assert rest.get_pose().x == pytest.approx(0.0, abs=0.05)
        assert not robot_server.stage.obstacles
        rest.begin("MoveToAction", MoveToOptions(Location(0.5, 0.0), MoveOptions())).wait()
        robot_server.stage.add_obstacle(robot_server.pose().compose(Pose(1.0)))


def run_pytest(folder: Path, source: str, *options: str) -> subprocess.CompletedProcess[str]:
    (folder / "test_it.py").write_text(source)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options, str(folder)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


FAILING = """
import unittest, pytest
from roboglot.testing.case import RobotTestCase

@pytest.mark.world("empty")
def test_fails(robot_server, rest):
    rest.get_power_status()
    assert False, "<b>on purpose</b>"

class TestCase(RobotTestCase):
    world = "empty"
    def test_passes(self):
        self.assertGreater(self.robomaster.robot.get_battery(), 50)
    def test_fails(self):
        self.rest.get_power_status()
        self.fail("on purpose")
"""


@pytest.mark.slow
def test_failed_tests_leave_recording_map_and_exchanges(tmp_path: Path) -> None:
    done = run_pytest(tmp_path, FAILING, "--junitxml", "junit.xml", "--roboglot-failures", "left")
    assert "2 failed, 1 passed" in done.stdout, done.stdout + done.stderr
    left = sorted((tmp_path / "left").iterdir())
    assert len(left) == 2
    for folder in left:
        assert (folder / "map.png").read_bytes().startswith(b"\x89PNG")
        assert "power/status" in (folder / "exchanges.html").read_text()
        recorded = read_recording(folder / "recording.mcap")
        assert any("power/status" in exchange.operation for exchange in recorded.exchanges)
    [page] = [text for folder in left if "on purpose&lt;/b" in (text := (folder / "exchanges.html").read_text())]
    assert "<b>" not in page
    files = sorted(str(path) for folder in left for path in folder.iterdir())
    assert sorted(re.findall(r"^\[\[ATTACHMENT\|(.*)\]\]$", done.stdout, re.MULTILINE)) == files
    properties = ElementTree.parse(tmp_path / "junit.xml").iter("property")
    assert sorted(entry.attrib["value"] for entry in properties) == files


def test_a_robot_that_cannot_start_is_one_error() -> None:
    """It ended unittest's run of all tests."""

    class Broken(RobotTestCase):
        world = "empty_"

        def test_it(self) -> None:
            self.fail("there is no robot")

    result = unittest.TestResult()
    unittest.TestSuite((Broken("test_it"), unittest.FunctionTestCase(lambda: None))).run(result)
    assert (result.testsRun, result.failures) == (2, [])
    [(_, why)] = result.errors
    assert "did you mean 'empty'?" in why


@pytest.mark.slow
def test_wrong_words_in_a_marker_are_errors(tmp_path: Path) -> None:
    tests = "def test_it(robot_server): pass\n@pytest.mark.world(robots=())\ndef test_robots(robot_server): pass\n"
    done = run_pytest(tmp_path, f"import pytest\n@pytest.mark.world(sede=1)\n{tests}")
    assert "world has no sede" in done.stdout + done.stderr
    assert "robots names at least one robot" in done.stdout + done.stderr


DOORS = {
    "slamware": {"port": 1449},
    "robomaster": {"control_port": 40933, "push_port": 40934},
    "cyberdog": {"port": 50062},
    "visual": {"port": 50063},
}


@pytest.mark.world("empty", doors=DOORS)
def test_clients_find_doors_at_configured_ports(
    robot_server: RobotServer, rest: Any, robomaster: Any, cyberdog: Any, program: Any
) -> None:
    """``url`` and all clients went to the usual ports, where nothing listened."""
    assert robot_server.url.endswith(":1449")
    assert "get_power_status" in dir(rest)  # for completion at a prompt
    assert "inject_fault" in dir(robot_server.stage)
    with pytest.raises(ValueError, match="time does not go back"):
        robot_server.forward(-1.0)  # passed at once while a clock ran
    assert robot_server.programs_url.endswith(":50063/programs")
    assert rest.get_power_status().battery_percentage > 50
    assert robomaster.robot.get_battery() > 50
    assert cyberdog.found() is not None
    assert cyberdog.connected
    assert program.run(PROGRAM).printed == ["hello"]


@pytest.mark.world("empty", doors={"cyberdog": {"app": "127.0.0.1:19345", "plaintext": True}})
def test_a_configured_app_is_called_there(robot_server: RobotServer, cyberdog: Any) -> None:
    assert robot_server.app_port == 19345
    assert cyberdog.found() is not None
    assert cyberdog.connected


def test_an_unknown_robots_client_is_refused_by_name() -> None:
    config = Config(robots=(RobotConfig("a"), RobotConfig("bob")))
    with (
        contextlib.closing(asyncio.new_event_loop()) as loop,
        pytest.raises(ValueError, match="no robot 'c'; there are a"),
    ):
        Clients(config, Loop(loop)).new_rest("c")
