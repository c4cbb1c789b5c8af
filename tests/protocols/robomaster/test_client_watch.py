"""A client that is gone without a word: no FIN, no RST, the cable is cut."""

import asyncio
import json
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.limits import WATCH_MISSES_MAX, WATCH_PERIOD
from roboglot.protocols.robomaster.liveness import ClientWatch, DrivingClient, Echoes
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.testing import Forward
from tests.protocols.robomaster.conftest import Connect

LAB = Path(__file__).with_name("dead_client_lab.py")
ALONE = ("unshare", "--user", "--map-root-user", "--net")


@pytest.fixture(scope="module")
def network() -> None:
    """A network of one's own, which not every machine grants."""
    for tool, package in (("unshare", "util-linux"), ("nsenter", "util-linux"), ("ip", "iproute2")):
        if shutil.which(tool) is None:
            pytest.skip(f"this machine has no {tool} (Debian: apt-get install {package})")
    trial = subprocess.run(
        [*ALONE, "ip", "link", "add", "va", "type", "veth", "peer", "name", "vb"], capture_output=True
    )
    if trial.returncode:
        pytest.skip(f"a network of one's own is not permitted here: {trial.stderr.decode().strip()}")


@pytest.mark.slow  # in real time, on a network of its own; test_the_door_stops_what_a_lost_client_drives
@pytest.mark.parametrize(
    ("groups", "ordered", "stopped"),
    [("0 0", 0.5, 0.6), ("", 1.6, 1.7)],
    ids=["with echoes", "without"],
)
def test_the_robot_stops_when_the_cable_is_cut(network: None, groups: str, ordered: float, stopped: float) -> None:
    """0.5 s is the claim; standing still takes the brakes a moment more."""
    ended = subprocess.run([*ALONE, sys.executable, str(LAB), groups], capture_output=True, text=True, timeout=180)
    assert ended.returncode == 0, ended.stderr
    reported = json.loads(ended.stdout)
    assert reported["alive"] > 0.35, "a client that only listens is alive"
    assert reported["ordered"] < ordered
    assert reported["stopped"] < stopped
    assert 3 < reported["forgotten"] < 7, "the session ends with the connection, which the kernel gives up"


@pytest.mark.world("empty", body="robomaster_ep")
async def test_the_door_stops_what_a_lost_client_drives(
    connect: Connect, door: RoboMasterDoor, robot: Robot, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same without a cable: its host answers echoes, then no more; the test looks when it likes."""
    answering = {"127.0.0.1"}
    monkeypatch.setattr(DrivingClient, "askable", True)
    monkeypatch.setattr(Echoes, "answered", lambda _self: set(answering))
    monkeypatch.setattr(ClientWatch, "_plan", lambda _self: None)
    client = await connect()

    async def look_often() -> None:
        for _ in range(WATCH_MISSES_MAX):
            door._watch._looked = asyncio.get_running_loop().time() + 3600  # acknowledgements are all older
            door._watch._look()
            await forward(seconds=WATCH_PERIOD)

    assert await client.ask("command;") == "ok;"
    assert await client.ask("chassis speed x 0.4;") == "ok;"
    await forward(seconds=0.5)
    await look_often()
    await look_often()
    assert robot[Base].velocity.x > 0.35
    answering.clear()
    await look_often()
    assert not robot.actions.running()
    await forward(seconds=0.5)
    assert robot[Base].velocity.speed < 0.02


@pytest.fixture
def driver():
    """A client on another host, by its address; its socket has a living end."""
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as near:
        far, _ = server.accept()
        with far:
            yield DrivingClient("10.0.0.1:5000", "10.0.0.1", near)


def test_silence_alone_is_no_death(driver: DrivingClient) -> None:
    assert not any(driver.missing(False, 0.0) for _ in range(50)), "its host never answered an echo: it may not want to"


def test_host_that_answered_and_stops_answering_is_gone(driver: DrivingClient) -> None:
    assert not driver.missing(True, 0.0)
    assert [driver.missing(False, 0.0) for _ in range(WATCH_MISSES_MAX + 2)].index(True) == WATCH_MISSES_MAX - 1


def test_one_answer_among_many_losses_is_life(driver: DrivingClient) -> None:
    driver.missing(True, 0.0)
    for _ in range(20):
        assert not any(driver.missing(False, 0.0) for _ in range(WATCH_MISSES_MAX - 1))
        assert not driver.missing(True, 0.0)


def test_acknowledged_data_counts_as_life(driver: DrivingClient) -> None:
    driver.missing(True, 0.0)
    assert not any(driver.missing(False, 3600.0) for _ in range(20))


def test_hosts_of_this_machine_are_not_asked() -> None:
    with socket.socket() as unused:
        assert not DrivingClient("127.0.0.1:5000", "127.0.0.1", unused).askable
    assert not DrivingClient("/tmp/ep-a:0", "/tmp/ep-a", None).askable
    assert not DrivingClient("10.0.0.1:5000", "10.0.0.1", None).askable


async def test_idle_client_is_never_reported_gone(driver: DrivingClient) -> None:
    gone: list[str] = []
    watch = ClientWatch(lambda: [driver], lambda _name: False, gone.append)
    watch._echoes = Echoes()
    driver.missing(True, 0.0)
    for _ in range(20):
        watch._look()
    assert gone == []
    watch._drives = lambda _name: True
    for _ in range(WATCH_MISSES_MAX + 2):
        watch._looked += 3600
        watch._look()
    assert gone == ["10.0.0.1:5000"], "once"
    watch.close()
