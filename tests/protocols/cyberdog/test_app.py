"""The robot as the app's client: heartbeats, loss, dialling again, pushes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

import grpc
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink, AppRoute, early_share, host_of
from roboglot.protocols.cyberdog.chapters.motion.motion import SERVO_RESPONSE
from roboglot.protocols.cyberdog.chapters.programming import TO_APP
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.outbox import Outbox
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.table import push, pushes
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world
from roboglot.wire.cyberdog.proto.cyberdog_app_pb2 import Ticks
from roboglot.wire.visual.relay import FrontEnd
from tests.drivers.settling import settle
from tests.protocols.cyberdog.phone import ADDRESS, App, Client, Messages, Pems, context_of, until

Passing = Callable[[Callable[[], object]], Awaitable[None]]


@pytest.fixture
def robot(walker: tuple[World, Robot]) -> Robot:
    return walker[1]


@pytest.fixture
async def phoned(door: CyberDogDoor, app: App, robot: Robot, data: Path) -> AsyncIterator[CyberDogDoor]:
    """A door whose app is configured, and that no one calls."""
    opened = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app=f"127.0.0.1:{app.port}"), data)
    app.robot = opened
    await opened.start()
    yield opened
    await opened.close()


def credentials(pems: Pems) -> grpc.ServerCredentials:
    return grpc.ssl_server_credentials(((pems.key, pems.certificate),), pems.ca, require_client_auth=True)


async def test_heartbeat_carries_the_robots_state(phoned, app, robot, passing: Passing) -> None:
    await passing(lambda: app.connected)
    ticks = app.ticks[0]
    assert ticks.ip == ADDRESS
    assert ticks.sn == robot.description.serial
    assert ticks.battery_power == round(100 * robot[Battery].state.percentage)
    assert 50 <= ticks.wifi_strength <= 100
    assert (ticks.motion_status.motion_id, ticks.task_status.task_status) == (111, 101)
    assert (ticks.internet, ticks.audio, ticks.state_switch_status.state) == (True, False, 0)
    await passing(lambda: len(app.ticks) > 2)
    charging = app.ticks[-1].charging_status
    assert (charging.wired_charging, charging.wireless_charging) == (False, True)  # it woke up on its dock


async def test_heartbeats_come_every_half_second(phoned, app, clock: LockstepClock, passing: Passing) -> None:
    await passing(lambda: phoned._context.app.connected)
    await settle()
    for beats in range(len(app.ticks) + 1, len(app.ticks) + 5):
        await clock.advance(0.5)
        await until(partial(lambda beats: len(app.ticks) == beats, beats))
        await settle()  # until the reply has arrived
        assert len(app.ticks) == beats


async def test_without_an_address_no_one_is_dialled(door, app, forward) -> None:
    await forward(seconds=3)
    await settle()
    assert not app.ticks


async def test_lying_dog_gets_up_for_its_first_app(door, client, app, robot, forward, passing: Passing) -> None:
    robot[Legs].lie_down()
    await forward(seconds=5)
    await client.ask(10001)
    await passing(lambda: app.connected)
    await passing(lambda: robot[Legs].posture is Posture.STANDING)
    robot[Legs].lie_down()
    await client.ask(55001)
    await passing(lambda: robot[Legs].posture is Posture.LYING)
    seen = len(app.ticks)
    await client.ask(10001)
    await passing(lambda: len(app.ticks) > seen + 2)
    assert robot[Legs].posture is Posture.LYING


async def test_a_lost_app_is_dialled_again(
    phoned: CyberDogDoor, app: App, messages: Messages, pems: Pems, passing: Passing, clock: LockstepClock
) -> None:
    link = context_of(phoned).app
    await passing(lambda: link.connected)
    await app.stop()
    lost_from = clock.time()
    await passing(lambda: not link.connected)
    assert 4.5 <= clock.time() - lost_from <= 6.5  # 5 s after its last message, which may be earlier
    again = App(messages)
    await again.start(credentials(pems), app.port)
    await passing(lambda: again.ticks)
    await until(lambda: link.connected)
    await again.stop()


async def test_a_silent_app_is_a_lost_one(phoned, app, passing: Passing) -> None:
    link = phoned._context.app
    await passing(lambda: link.connected)
    app.silent = True
    await passing(lambda: not link.connected)
    app.silent = False
    await passing(lambda: link.connected)


async def test_log_names_pushes_an_app_does_not_take(phoned, app, passing: Passing, caplog) -> None:
    link = phoned._context.app
    await passing(lambda: link.connected)
    app.refusing = True
    link.push(SERVO_RESPONSE, "{}")
    await passing(lambda: "the app answers push 1003 with the error internal" in caplog.text)
    app.refusing = False
    app.gate.clear()
    link.push(SERVO_RESPONSE, "{}")
    await passing(lambda: "the app did not answer push 1003 within 3.0 s" in caplog.text)
    assert link.connected


async def test_an_app_with_a_strange_certificate_gets_nothing(
    robot: Robot, data: Path, messages: Messages, pems: Pems, tmp_path: Path, forward
) -> None:
    from roboglot.protocols.cyberdog.certificates import ensure_certificates

    other = ensure_certificates(tmp_path)
    stranger = App(messages)
    await stranger.start(grpc.ssl_server_credentials(((other.key, other.certificate),)))
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app=f"127.0.0.1:{stranger.port}"), data)
    await door.start()
    for _ in range(20):
        await forward(seconds=0.1)
        await settle()
    assert not stranger.ticks
    await door.close()
    await stranger.stop()


async def test_second_client_does_not_take_app_s_place(door, client, app, pems, messages, passing) -> None:
    await client.ask(10001)
    await passing(lambda: door._context.app.connected)
    door._context.app.seen("ipv4:127.0.0.99:4711")
    seen = len(app.ticks)
    await passing(lambda: len(app.ticks) > seen + 2)


class Dialling(AppLink):
    """No app answers: every attempt lasts five seconds."""

    async def _keep(self, _target: str) -> bool:
        self.attempts = [*getattr(self, "attempts", []), self._clock.time()]
        await self._clock.sleep(5.0)
        return False


async def test_call_during_attempt_leads_to_next_at_once(clock: LockstepClock) -> None:
    link = Dialling(clock, None, AppRoute(ADDRESS, "127.0.0.1:1", 1), ticks=lambda _: Ticks())
    link.start()
    await clock.advance(2.0)
    link.seen("ipv4:127.0.0.1:4711")
    await clock.advance(4.0)
    assert link.attempts == [0.0, 5.0]
    await clock.advance(5.5)  # no call came during the second attempt: a pause follows
    assert link.attempts == [0.0, 5.0]
    await clock.advance(1.0)
    assert link.attempts == [0.0, 5.0, pytest.approx(12.0)]
    await link.close()


async def test_calls_without_end_leave_pauses_between_attempts(
    clock: LockstepClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor do they wake the link each: a client that is no app may call thousands of times a second."""
    wait_for, woken = clock.wait_for, list[float]()

    def counted(awaited: Any, left: float) -> Any:
        woken.append(left)
        return wait_for(awaited, left)

    monkeypatch.setattr(clock, "wait_for", counted)
    link = Dialling(clock, None, AppRoute(ADDRESS, "127.0.0.1:1", 1), ticks=lambda _: Ticks())
    link.start()
    for _ in range(400):
        await clock.advance(0.1)
        link.seen("ipv4:127.0.0.1:4711")
    assert link.attempts == pytest.approx([0.0, 5.0, 12.0, 21.0, 30.0, 39.0], abs=0.11)
    assert len(woken) <= 2 * len(link.attempts)
    await link.close()


async def test_disconnect_forgets_the_app_until_it_calls_again(door, client, app, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: door._context.app.connected)
    assert await client.ask(55001) == ""
    await passing(lambda: not door._context.app.connected)
    seen = len(app.ticks)
    await forward(seconds=3)
    await settle()
    assert len(app.ticks) == seen
    await client.ask(10001)
    await passing(lambda: len(app.ticks) > seen)


async def test_pushes_without_an_app_are_dropped(door, app, client, passing: Passing) -> None:
    link = door._context.app
    link.push(TO_APP, "too early")
    await client.ask(10001)
    await passing(lambda: link.connected)
    link.push(TO_APP, "in time")
    await until(lambda: app.pushed)
    assert app.pushed == [(2001, "in time")]
    link.push(TO_APP, "x" * 5_000_000)
    link.push(TO_APP, "after")
    await until(lambda: len(app.pushed) == 2)
    assert app.pushed[1] == (2001, "after")


async def test_slow_app_gets_newest_delaying_no_other_code(door, app, client, passing: Passing) -> None:
    link = door._context.app
    await client.ask(10001)
    await passing(lambda: link.connected)
    app.gate.clear()
    for number in range(20):
        link.push(pushes[1003], {"n": number})
        if number == 0:
            await until(lambda: app.pushed)
    link.push(pushes[6005], {"pose": 1})
    await until(lambda: app.of(6005))
    app.gate.set()
    await until(lambda: len(app.of(1003)) == 3)
    assert [message["n"] for message in app.of(1003)] == [0, 18, 19]


async def test_unanswered_push_blocks_for_three_seconds(door, app, client, passing, clock) -> None:
    link = door._context.app
    await client.ask(10001)
    await passing(lambda: link.connected)
    app.gate.clear()
    link.push(pushes[1003], {"n": 0})
    link.push(pushes[1003], {"n": 1})
    began = clock.time()
    await passing(lambda: len(app.of(1003)) == 2)
    assert 2.9 <= clock.time() - began <= 3.5


class Programs:
    """A relay that keeps what it gets and answers at once."""

    def __init__(self) -> None:
        self.got: list[str] = []
        self.front_end: FrontEnd | None = None

    async def receive(self, text: str) -> None:
        self.got.append(text)
        if self.front_end:
            self.front_end.answer(json.dumps({"feedback": {"state": 0}}))

    def attach(self, front_end: FrontEnd) -> Callable[[], None]:
        self.front_end = front_end

        def end() -> None:
            self.front_end = None

        return end


async def test_program_frames_pass_through(robot, data, app, pems, messages, passing: Passing) -> None:
    programs = Programs()
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=app.port), data, frames=programs)
    await door.start()
    async with pems.channel(door.port) as channel:
        client = Client(channel, messages)
        await client.ask(10001)
        await passing(lambda: context_of(door).app.connected)
        frame = '{ "type":"task",   "body":"1+1\\n" }'
        assert await client.raw(2002, frame) == []
        assert programs.got == [frame]
        await until(lambda: app.of(2001))
        assert app.of(2001) == [{"feedback": {"state": 0}}]
    await door.close()
    assert programs.front_end is None


async def test_body_without_legs_dials_when_called(clock, data, app, passing: Passing) -> None:
    world = World(load_world("office"), [RobotPlacement("a", "robomaster_ep")], clock=clock, seed=1)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app=f"127.0.0.1:{app.port}"), data)
    await door.start()
    await clock.advance(5.0)
    await settle()
    assert not app.ticks
    context_of(door).app.seen(f"ipv4:{ADDRESS}:4001")
    await passing(lambda: app.ticks)
    await door.close()
    world.close()


async def test_wildcard_address_becomes_the_route_to_the_app(robot, data, app, passing: Passing) -> None:
    door = CyberDogDoor(robot, "0.0.0.0", CyberDogConfig(port=0, app=f"127.0.0.1:{app.port}"), data)
    await door.start()
    await passing(lambda: app.ticks)
    assert app.ticks[0].ip == "127.0.0.1"
    await door.close()


async def test_an_outbox_keeps_order_and_drops_the_oldest() -> None:
    sent: list[str] = []
    gate = asyncio.Event()

    async def send(code: int, text: str) -> None:
        await gate.wait()
        sent.append(text)

    outbox = Outbox(1, 2, send)
    await asyncio.sleep(0)
    for text in "abcd":
        outbox.put(text)
    gate.set()
    await until(lambda: len(sent) == 2)
    assert (sent, outbox.dropped) == (["c", "d"], 2)
    await outbox.close()


@pytest.mark.parametrize(
    ("peer", "host"),
    [
        ("ipv4:10.0.0.7:51234", "10.0.0.7"),
        ("ipv6:%5B::1%5D:51234", "[::1]"),
        ("ipv6:[fe80::1]:5", "[fe80::1]"),
        ("unix:/tmp/x", ""),
        ("", ""),
    ],
)
def test_host_of_a_peer(peer: str, host: str) -> None:
    assert host_of(peer) == host


def test_a_push_is_declared_once() -> None:
    with pytest.raises(ValueError, match="twice"):
        push(6005, depth=1)


def test_heartbeats_of_a_hundred_dogs_are_spread():
    instants = sorted(early_share(f"127.0.1.{number}") for number in range(1, 101))
    assert all(0.0 <= instant <= 0.75 for instant in instants)
    for tenth in range(10):
        within = [i for i in instants if 0.075 * tenth <= i < 0.075 * (tenth + 1)]
        assert 3 <= len(within) <= 20
