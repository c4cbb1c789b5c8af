"""The client's link: refusals, time-outs, robots that vanish, talk nonsense, come back."""

import asyncio
import socket

import pytest

from roboglot.clients.errors import BadAnswer, LinkLost, TimedOut
from roboglot.clients.robomaster.client import LinkState, Ports, RoboMasterClient
from roboglot.clients.robomaster.control import PENDING_MAX
from roboglot.clients.robomaster.errors import RoboMasterRefused
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.protocols.robomaster.server import RoboMasterDoor

pytestmark = pytest.mark.world("empty", body="robomaster_ep")


class FakeRobot:
    """Answers ``ok`` to ``command``, and to anything else what it is given, as bytes; {} is the seq number."""

    def __init__(self) -> None:
        self.answers: list[str] = []
        self.got: list[str] = []
        self.writers: list[asyncio.StreamWriter] = []

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.writers.append(writer)
        try:
            while text := (await reader.readuntil(b";")).decode().rstrip(";"):
                command, _, number = text.partition(" seq ")
                self.got.append(command)
                answer = "ok seq {};" if command == "command" else self.answers.pop(0) if self.answers else ""
                writer.write(answer.format(number).encode())
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.close()


@pytest.fixture
async def fake():
    robot = FakeRobot()
    server = await asyncio.start_server(robot.serve, "127.0.0.1", 0)
    robot.server = server
    robot.port = server.sockets[0].getsockname()[1]
    yield robot
    server.close()
    for writer in robot.writers:
        writer.transport.abort()
    await asyncio.sleep(0.01)


@pytest.fixture
async def faked(fake, clock: LockstepClock, monkeypatch: pytest.MonkeyPatch):
    client = RoboMasterClient("127.0.0.1", clock=clock, ports=Ports(control=fake.port, event=fake.port, push=1))
    monkeypatch.setattr(client._events, "open", lambda _host: asyncio.sleep(0))
    await client.connect()
    yield client
    await client.close()


async def settle(seconds: float = 0.02) -> None:
    await asyncio.sleep(seconds)


async def test_a_refusal_carries_the_robots_words(client, run) -> None:
    with pytest.raises(RoboMasterRefused) as refused:
        await run(client.blaster.bead(9))
    assert (refused.value.operation, refused.value.code, refused.value.words) == ("blaster bead 9", "fail", "fail")
    await run(client.quit())
    with pytest.raises(RoboMasterRefused, match="not in sdk mode"):
        await run(client.chassis.stop())
    await run(client.command())
    await run(client.command())
    assert await run(client.ask("hello robot")) == "command format error: command parse error"


@pytest.mark.parametrize("word", ["a b", "a;b", "", "a\nb"])
async def test_nothing_is_smuggled_into_a_command(client, word: str) -> None:
    with pytest.raises(ValueError, match="not one word"):
        await client.robot.mode(word)
    with pytest.raises(ValueError, match="nan is not a finite number"):
        await client.chassis.speed(x=float("nan"))


@pytest.mark.parametrize(
    "answers",
    [["1 2 3 seq {};"], ["1 2 ", "3 seq {}"], ["1 2 3;"], ["1 2 3 ;"], ["1 2 3 seq {} ;"], ["; \r\n1 2 3 seq {};\n"]],
    ids=["spec", "fw60 in pieces", "no seq", "fw70 without seq", "fw70", "with line ends"],
)
async def test_answers_in_every_form(faked, fake, answers: list[str]) -> None:
    fake.answers = ["".join(answers)]
    attitude = await faked.chassis.get_attitude()
    assert (attitude.pitch, attitude.roll, attitude.yaw) == (1, 2, 3)
    fake.answers = ["fail"]  # the oldest builds send neither end nor number
    with pytest.raises(RoboMasterRefused):
        await faked.chassis.stop()


@pytest.mark.parametrize("answer", ["1 2;", "1 2 x;", "1 2 3 4;", "ok seq {};"])
async def test_an_answer_that_is_none(faked, fake, answer: str) -> None:
    fake.answers = [answer]
    with pytest.raises(BadAnswer):
        await faked.chassis.get_attitude()


async def test_many_at_once_each_get_their_own(faked, fake) -> None:
    fake.answers = [f"{n} 0 0 seq {{}}{end}" for n, end in zip(range(20), [";", " ;"] * 10, strict=True)]
    got = await asyncio.gather(*(faked.chassis.get_attitude() for _ in range(20)))
    assert [each.pitch for each in got] == list(range(20))


async def test_late_and_lost_answers_confuse_no_one(faked, fake, clock) -> None:
    asked = asyncio.ensure_future(faked.chassis.get_attitude())
    await settle()
    await clock.advance(3)
    with pytest.raises(TimedOut, match="chassis attitude"):
        await asked
    fake.answers = ["9 9 9 seq 2;1 2 3 seq {};"]
    assert (await faked.chassis.get_attitude()).pitch == 1
    lost = asyncio.ensure_future(faked.chassis.get_attitude())
    await settle()
    fake.answers = ["4 5 6 seq {};"]
    assert (await faked.chassis.get_attitude()).pitch == 4, "an answer that never came is passed over"
    await clock.advance(3)
    with pytest.raises(TimedOut):
        await lost


async def test_a_robot_that_never_answers_is_not_buried(faked) -> None:
    asked = [asyncio.ensure_future(faked.chassis.stop()) for _ in range(PENDING_MAX)]
    await settle()
    with pytest.raises(LinkLost, match="was not sent"):
        await faked.chassis.stop()
    await faked.close()
    assert all(isinstance(each, LinkLost) for each in await asyncio.gather(*asked, return_exceptions=True))


async def test_endless_talk_ends_the_link(faked, fake) -> None:
    fake.answers = ["x" * 5000]
    with pytest.raises(BadAnswer):
        await faked.chassis.stop()
    await settle()
    assert faked.state is LinkState.LOST


async def test_it_comes_back_by_itself_and_says_so(faked, fake, clock) -> None:
    states: list[str] = []
    again: list[str] = []

    async def set_up() -> None:
        again.append(await faked.ask("set up"))

    faked.at_change(states.append)
    faked.at_connect(set_up)
    fake.server.close()
    waiting = asyncio.ensure_future(faked.chassis.stop())
    await settle()
    fake.writers[0].close()
    with pytest.raises(LinkLost, match="ended"):
        await waiting
    with pytest.raises(LinkLost, match="was not sent"):
        await faked.chassis.stop()
    for _ in range(20):
        await clock.advance(1)
        await settle(0.002)
    assert states == ["lost"]
    with pytest.raises(LinkLost, match="cannot be reached"):
        await faked.connect()  # does not end the search
    fake.got.clear()
    fake.answers = ["ok seq {};"] * 2
    server = await asyncio.start_server(fake.serve, "127.0.0.1", fake.port)
    for _ in range(20):
        await clock.advance(1)
        await settle(0.002)
    assert states == ["lost", "connected"]
    assert fake.got == ["command", "set up"], "nothing that was asked meanwhile"
    assert again == ["ok"]
    await faked.chassis.stop()
    server.close()


async def test_unreachable_robot_is_reported(clock) -> None:
    client = RoboMasterClient("127.0.0.1", clock=clock, ports=Ports(control=1))
    with pytest.raises(LinkLost, match="cannot be reached"):
        await client.connect()
    with pytest.raises(LinkLost, match="not connected"):
        await client.chassis.stop()
    assert client.state is LinkState.CLOSED
    await client.close()


async def test_connecting_again(client, run) -> None:
    await client.connect()
    await run(client.robot.mode("free"))
    assert await run(client.robot.get_mode()) == "free", "it was the same session"
    await client.close()
    with pytest.raises(LinkLost):
        await client.chassis.stop()
    await run(client.connect())
    assert await run(client.robot.get_mode()) == "chassis_lead"


async def test_a_robot_that_vanishes_will_be_noticed(client) -> None:
    """The kernel probes after a second of silence and gives up after four."""
    connection = client._link._transport.get_extra_info("socket")
    assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 4000


async def test_closing_stops_what_it_commanded(client, run, robot, forward, door: RoboMasterDoor) -> None:
    await run(client.chassis.speed(x=0.3))
    await forward(seconds=1)
    assert robot[Base].velocity.x > 0.25
    await client.close()
    await asyncio.sleep(0.02)
    await forward(seconds=0.5)
    assert robot[Base].velocity.speed < 0.02
    assert not door.context.active
