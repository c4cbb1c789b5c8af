"""Any sequence of commands by any number of clients over real sockets, against a model of the robot's modes."""

import asyncio
import re
from collections.abc import Coroutine, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, ClassVar, TypeVar

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    RuleBasedStateMachine,
    consumes,
    initialize,
    invariant,
    multiple,
    precondition,
    rule,
)

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.sensing.camera import Camera
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.event_switches import EventSwitches
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.storage.database import Database
from tests.protocols.robomaster.text_client import ADDRESS, Inbox, TextClient, port_of

T = TypeVar("T")
RATES = [1, 5, 10, 20, 50]
ATTRIBUTES = {"position": "pfreq", "attitude": "afreq", "status": "sfreq"}
GROUP = {"person", "marker"}  # settings that exclude each other
IDLE, MISSING = "not in sdk mode;", "fail;"
switches = st.sampled_from(["on", "off"])


@dataclass
class Modes:
    """Modes of a session by the manual, without their implementation."""

    mode: str = "chassis_lead"
    beads: int = 1
    sensitivity: int = 5
    asleep: bool = False
    stream: bool = False
    audio: bool = False
    exposed: bool = False
    hits: bool = False
    seeing: set[str] = field(default_factory=set)
    pushed: dict[str, int] = field(default_factory=dict)
    rates: dict[str, int] = field(default_factory=dict)


@pytest.fixture(scope="module", autouse=True)
def lab() -> Iterator[None]:
    """One robot for all examples; each gets a door of its own."""
    with asyncio.Runner() as runner:
        clock, database = LockstepClock(), Database(":memory:")
        fleet = runner.run(_build(clock, database))
        Machine.lab = SimpleNamespace(runner=runner, clock=clock, robot=fleet.robots["a"])
        yield
        runner.run(fleet.close())
        database.close()


async def _build(clock: LockstepClock, database: Database) -> Any:
    fleet = build_fleet("empty", [RobotConfig(body="robomaster_ep")], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    return fleet


class Machine(RuleBasedStateMachine):
    """``modes`` is None outside SDK mode; ``members`` are the clients that keep it."""

    lab: ClassVar[SimpleNamespace]
    clients = Bundle("clients")

    def run(self, what: Coroutine[Any, Any, T]) -> T:
        result: T = self.lab.runner.run(what)
        return result

    @initialize(target=clients)
    def open_door(self) -> Any:
        """Start with two clients in SDK mode, close to all other states."""
        self.inbox = Inbox("127.0.0.1")
        self.modes: Any = None
        self.members: set[TextClient] = set()
        self.open: set[TextClient] = set()
        config = RoboMasterConfig(0, 0, 0, self.inbox.port, 0, self.inbox.port)
        self.door = RoboMasterDoor(self.lab.robot, ADDRESS, config)
        self.run(self.door.start())
        first, second = self.connect(), self.connect()
        self.enter(first)
        self.enter(second)
        return multiple(first, second)

    def teardown(self) -> None:
        if hasattr(self, "door"):
            self.run(self._shut())
            self.inbox.socket.close()

    async def _shut(self) -> None:
        for client in self.open:
            client.writer.transport.abort()
        await self.door.close()
        for _ in range(20):
            if not self.lab.robot.actions.running():
                break
            await self.lab.clock.advance(0.1)

    async def _ask(self, client: TextClient, text: str) -> str:
        client.send(f"{text};")
        reply = asyncio.ensure_future(client.reply())
        while not reply.done():
            await asyncio.sleep(0.0002)
            await self.lab.clock.advance(0.02)
        return await reply

    def says(self, client: TextClient, text: str, right: str) -> bool:
        """Send it and compare; whether it was done."""
        inside = self.modes is not None
        got = self.run(self._ask(client, text))
        assert got == (right if inside else IDLE), text
        if inside:
            self.members.add(client)
        return inside and got != MISSING

    # -- connections ---------------------------------------------------------------------------------------------------

    @precondition(lambda self: len(self.open) < 4)
    @rule(target=clients)
    def connect(self) -> TextClient:
        streams = self.run(asyncio.open_connection(ADDRESS, port_of(self.door, "text SDK")))
        client = TextClient(*streams)
        self.open.add(client)
        return client

    @rule(client=consumes(clients), tail=st.sampled_from(["", "chassis sp", "robot mode", "\x00\xff"]))
    def disconnect(self, client: TextClient, tail: str) -> None:
        """Half a command may be left lying about."""
        client.send(tail)
        self.run(client.close())
        self.open.discard(client)
        self.members.discard(client)
        if not self.members:
            self.modes = None

    @rule(client=clients)
    def enter(self, client: TextClient) -> None:
        right = "Already in SDK mode;" if self.modes is not None else "ok;"
        assert self.run(self._ask(client, "command")) == right
        self.modes = self.modes or Modes()
        self.members.add(client)

    @rule(client=clients, really=st.integers(0, 3).map(lambda number: number == 3))
    def leave(self, client: TextClient, really: bool) -> None:
        if not really:  # otherwise sessions would be too short for anything to happen
            return
        right = "ok;" if self.modes is not None else "quit sdk mode failed;"
        assert self.run(self._ask(client, "quit")) == right
        self.modes, self.members = None, set()

    # -- settings ------------------------------------------------------------------------------------------------------

    @rule(client=clients, mode=st.sampled_from(["chassis_lead", "gimbal_lead", "free"]))
    def set_mode(self, client: TextClient, mode: str) -> None:
        if self.says(client, f"robot mode {mode}", "ok;"):
            self.modes.mode = mode

    @rule(client=clients)
    def ask_settings(self, client: TextClient) -> None:
        modes = self.modes or Modes()
        self.says(client, "robot mode ?", f"{modes.mode};")
        self.says(client, "blaster bead ?", f"{modes.beads};")
        self.says(client, "armor sensitivity ?", f"{modes.sensitivity};")

    @rule(client=clients, number=st.integers(-1, 12))
    def set_numbers(self, client: TextClient, number: int) -> None:
        if self.says(client, f"blaster bead {number}", "ok;" if 1 <= number <= 5 else MISSING):
            self.modes.beads = number
        if self.says(client, f"armor sensitivity {number}", "ok;" if 1 <= number <= 10 else MISSING):
            self.modes.sensitivity = number

    @rule(client=clients, word=st.sampled_from(["suspend", "resume"]))
    def sleep_or_wake(self, client: TextClient, word: str) -> None:
        if self.says(client, f"gimbal {word}", "ok;"):
            self.modes.asleep = word == "suspend"

    @rule(client=clients, verb=st.sampled_from(["speed p 5", "move p 1 wait_for_complete false", "recenter"]))
    def aim(self, client: TextClient, verb: str) -> None:
        asleep = self.modes is not None and self.modes.asleep
        self.says(client, f"gimbal {verb}", MISSING if asleep else "ok;")

    @rule(client=clients, stream=st.sampled_from(["stream", "audio"]), switch=switches)
    def switch_stream(self, client: TextClient, stream: str, switch: str) -> None:
        if self.says(client, f"{stream} {switch}", "ok;"):
            setattr(self.modes, stream, switch == "on")

    @rule(client=clients, level=st.sampled_from(["default", "large"]))
    def expose(self, client: TextClient, level: str) -> None:
        if self.says(client, f"camera exposure {level}", "ok;"):
            self.modes.exposed = level == "large"

    @rule(client=clients, switch=switches)
    def switch_events(self, client: TextClient, switch: str) -> None:
        if self.says(client, f"armor event hit {switch}", "ok;"):
            self.modes.hits = switch == "on"

    @rule(
        client=clients,
        wanted=st.dictionaries(
            st.sampled_from(["marker", "person", "line"]), st.sampled_from(["on", "on", "off"]), min_size=1, max_size=2
        ),
    )
    def see(self, client: TextClient, wanted: dict[str, str]) -> None:
        seeing = self.modes.seeing if self.modes else set()
        after = {name for name in {*seeing, *wanted} if wanted.get(name, "on") == "on"}
        words = " ".join(f"{name} {switch}" for name, switch in wanted.items())
        if self.says(client, f"AI push {words}", MISSING if len(after & GROUP) > 1 else "ok;"):
            self.modes.seeing = after

    # -- pushes --------------------------------------------------------------------------------------------------------

    @rule(
        client=clients,
        wanted=st.dictionaries(
            st.sampled_from(sorted(ATTRIBUTES)),
            st.tuples(switches, st.sampled_from([None, None, 7, *RATES])),
            min_size=1,
        ),
        freq=st.sampled_from([None, None, 10, 50]),
    )
    def push(self, client: TextClient, wanted: dict[str, tuple[str, int | None]], freq: int | None) -> None:
        words = [
            f"{name} {switch}" + (f" {ATTRIBUTES[name]} {rate}" if rate else "")
            for name, (switch, rate) in wanted.items()
        ]
        valid = all(rate != 7 for _, rate in wanted.values())
        if freq:
            words.append(f"freq {freq}")
        if not self.says(client, f"chassis push {' '.join(words)}", "ok;" if valid else MISSING):
            return
        for name in ATTRIBUTES:
            switch, rate = wanted.get(name, (None, None))
            rates, pushed = self.modes.rates, self.modes.pushed
            rates[name] = freq or rate or (5 if switch == "off" else rates.get(name, 5))
            if switch == "off":
                pushed.pop(name, None)
            elif switch == "on" or name in pushed:
                pushed[name] = rates[name]
        self.two_seconds()

    @rule()
    def two_seconds(self) -> None:
        """Assert that the pushes of two seconds are those asked for, each at its own rate."""
        self.inbox.drain()
        self.run(self.lab.clock.advance(2.0))
        got = re.findall(r"chassis push (\w+)", " ".join(self.inbox.texts()))
        pushed = self.modes.pushed if self.modes else {}
        for name in ATTRIBUTES:
            assert abs(got.count(name) - 2 * pushed.get(name, 0)) <= (name in pushed), name

    # -- what must hold after every step -------------------------------------------------------------------------------

    @invariant()
    def the_robot_is_as_the_modes_say(self) -> None:
        if not hasattr(self, "door"):
            return
        session, modes = self.door.context, self.modes or Modes()
        assert session.active == (self.modes is not None)
        assert (self.door.video.on, self.door.audio.on) == (modes.stream, modes.audio)
        assert session.part(EventSwitches)._stops.keys() == ({"armor"} if modes.hits else set())
        assert self.lab.robot[Gimbal].mode == modes.mode
        assert (self.lab.robot[Camera].exposure != 0) == modes.exposed


PHASES = (Phase.explicit, Phase.reuse, Phase.generate)  # shrinking would take minutes
Machine.TestCase.settings = settings(max_examples=6, stateful_step_count=50, deadline=None, phases=PHASES)
TestMachine = Machine.TestCase


class LongMachine(Machine):
    """The same with more examples, each a world of its own and real sockets."""


LongMachine.TestCase.settings = settings(Machine.TestCase.settings, max_examples=60)
TestLongMachine = pytest.mark.slow(LongMachine.TestCase)  # longer sessions of the same machine
