"""Program frames over gRPC, to a phone that takes its time: all arrive, answers first, and the program waits."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import grpc
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks import call_time
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.cyberdog.app_line import AppLine, delivery
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.frame_queue import NEWS_MAX, ROOM, Delivery, FrameQueue
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.visual.server import VisualDoor
from roboglot.simulation.world.world import World
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from roboglot.wire.cyberdog.channel import SERVICE
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.visual.codes import FeedbackState
from tests.protocols.cyberdog.phone import ADDRESS, App, Client, Messages, Pems, context_of, until

Frame = dict[str, Any]
PUSH_ROOM = 4_194_304


@dataclass
class Phone:
    """A client of one robot whose app gets the frames."""

    client: Client
    app: App
    service: ProgramService
    door: CyberDogDoor

    async def send(self, frame: Frame) -> None:
        assert await self.client.raw(2002, json.dumps(frame)) == []

    async def ask(self, operate: str, *targets: str, **fields: str) -> None:
        """A frame whose id is its operation's name."""
        await self.send({"type": "task", "id": operate, "operate": operate, "target_id": targets} | fields)

    async def start(self, id: str, body: str) -> None:
        await self.ask("save", id, mode="single", condition="now", body=body)
        await self.ask("run", id)

    @property
    def frames(self) -> list[Frame]:
        return self.app.of(2001)

    def answers(self, id: str) -> list[Frame]:
        contents = [frame.get("feedback") or frame["response"] for frame in self.frames]
        return [content for content in contents if content["id"] == id]

    def blocks(self) -> list[tuple[str, str]]:
        return [(frame["block"]["type"], frame["block"]["id"]) for frame in self.frames if "block" in frame]


@pytest.fixture
async def phone(
    walker: tuple[World, Robot],
    clock: LockstepClock,
    data: Path,
    app: App,
    pems: Pems,
    messages: Messages,
    passing: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
) -> AsyncIterator[Phone]:
    """A phone whose app is connected to a robot that runs programs; their calls wait for the phone alone."""
    monkeypatch.setattr(call_time, "INSTANT_MAX", 1_000_000)  # time stands still here
    robot = walker[1]
    async with contextlib.AsyncExitStack() as stack:
        database = Database(":memory:")
        stack.callback(database.close)
        service = ProgramService(robot, await stack.enter_async_context(Engine()), program_stores(database, robot.id))
        visual = VisualDoor(service)
        await visual.start()
        stack.push_async_callback(visual.close)
        door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=app.port), data, frames=visual)
        await door.start()
        stack.push_async_callback(door.close)
        client = Client(await stack.enter_async_context(pems.channel(door.port)), messages)
        await client.ask(10001)
        context = context_of(door)
        await passing(lambda: context.app.connected)
        yield Phone(client, app, service, door)


def in_pairs(count: int) -> list[tuple[str, str]]:
    return [(kind, str(number)) for number in range(count) for kind in ("begin", "end")]


@pytest.mark.slow  # in short: test_each_kind_keeps_its_order
async def test_every_block_of_quick_program_arrives_in_order(phone: Phone) -> None:
    phone.app.slowness = 0.002
    await phone.start("t", "for n in range(40): cyberdog.task.block(str(n))")
    await until(lambda: len(phone.blocks()) == 80)
    assert phone.blocks() == in_pairs(40)


async def test_an_inquiry_overtakes_what_programs_do(phone: Phone) -> None:
    phone.app.slowness = 0.01
    await phone.start("t", "n = 0\nwhile True:\n    cyberdog.task.block(str(n))\n    n += 1")
    await until(lambda: len(phone.blocks()) > 20)
    for round in range(1, 4):
        before = len(phone.blocks())
        await phone.ask("inquiry", "t")
        await until(partial(lambda round: len(phone.answers("inquiry")) == round, round))
        assert len(phone.blocks()) - before <= ROOM
    await phone.ask("shutdown", "t")
    await until(lambda: any(frame["feedback"]["id"] == "shutdown" for frame in phone.frames if "feedback" in frame))
    names = [int(name) for kind, name in phone.blocks() if kind == "begin"]
    assert names == list(range(len(names)))


async def test_a_program_waits_for_a_slow_phone(phone: Phone) -> None:
    phone.app.gate.clear()
    await phone.start("t", "for n in range(10000): cyberdog.task.block(str(n))\nprint('through')")
    queue = context_of(phone.door).frames
    assert queue is not None
    await until(lambda: queue._news >= ROOM)
    await asyncio.sleep(0.2)
    assert queue._news < 2 * ROOM
    assert not any(entry.text == "through" for entry in await phone.service.log("t"))
    phone.app.gate.set()
    await phone.ask("shutdown", "t")


async def test_thirty_targets_get_thirty_feedbacks(phone: Phone) -> None:
    phone.app.slowness = 0.002
    await phone.ask("delete", *(f"t{number}" for number in range(30)))
    await until(lambda: len(phone.answers("delete")) == 30)
    assert [answer["target_id"] for answer in phone.answers("delete")] == [f"t{number}" for number in range(30)]


async def test_list_too_large_for_message_comes_in_parts(phone: Phone) -> None:
    style = "样" * 500_000
    for number, text in enumerate((style, style, style, style, 3 * style)):
        await phone.service._store.put(StoredProgram(f"t{number}", "", text, "single", "now", "pass", "wait_run"))
    await phone.ask("inquiry")
    await until(lambda: len(phone.answers("inquiry")) == 3)
    first, second, refused = phone.answers("inquiry")
    assert [(part["part"], part["parts"], len(part["list"])) for part in (first, second)] == [(1, 2, 2), (2, 2, 2)]
    assert (refused["state"], refused["target_id"]) == (FeedbackState.OTHER, "t4")
    assert all(len(text.encode()) < PUSH_ROOM for _, text in phone.app.pushed)


async def test_invalid_json_is_answered_by_a_frame(phone: Phone) -> None:
    assert await phone.client.raw(2002, "{not json") == []
    await until(lambda: phone.frames)
    assert phone.frames[0]["feedback"]["state"] == FeedbackState.NOT_JSON


async def test_the_first_request_of_all_is_answered(
    walker: tuple[World, Robot],
    clock: LockstepClock,
    data: Path,
    app: App,
    pems: Pems,
    messages: Messages,
    passing: Callable[..., Any],
) -> None:
    """The robot learns the app's address by this very request: its answer waits until the app is reached."""
    database = Database(":memory:")
    async with Engine() as engine:
        visual = VisualDoor(ProgramService(walker[1], engine, program_stores(database, walker[1].id)))
        await visual.start()
        door = CyberDogDoor(walker[1], ADDRESS, CyberDogConfig(port=0, app_port=app.port), data, frames=visual)
        await door.start()
        async with pems.channel(door.port) as channel:
            frame = {"type": "task", "id": "f1", "operate": "inquiry", "target_id": []}
            await Client(channel, messages).raw(2002, json.dumps(frame))
            await passing(lambda: app.of(2001))
        await door.close()
        await visual.close()
    database.close()


class Wire:
    """A connection that takes what it is sent in the end, and breaks when it is asked to."""

    def __init__(self) -> None:
        self.sent: list[str] = []
        self.under_way = self.most = 0
        self.outcome = Delivery.DONE
        self.gate = asyncio.Event()

    async def send(self, text: str) -> Delivery:
        if self.outcome is Delivery.DONE:
            self.sent.append(text)
        self.under_way += 1
        self.most = max(self.most, self.under_way)
        await self.gate.wait()
        self.under_way -= 1
        return self.outcome


async def settled(queue: FrameQueue) -> None:
    while queue._sending or (queue._waiting and queue._there and not queue._holding):  # noqa: ASYNC110
        await asyncio.sleep(0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.booleans(), st.sampled_from([1, 40_000])), max_size=60))
def test_each_kind_keeps_its_order(frames: list[tuple[bool, int]]) -> None:
    async def run() -> None:
        wire = Wire()
        queue = FrameQueue(wire.send, LockstepClock(), 0)
        queue.open()
        for number, (answer, size) in enumerate(frames):
            (queue.answer if answer else queue.publish)(f"{number:03}" + size * "x")
        wire.gate.set()
        await settled(queue)
        numbers = [int(text[:3]) for text in wire.sent]
        for kind in (True, False):
            assert [n for n in numbers if frames[n][0] is kind] == [n for n, f in enumerate(frames) if f[0] is kind]

    asyncio.run(run())


async def test_frames_go_one_after_the_other(clock: LockstepClock) -> None:
    """An app with threads reads calls that overlap in any order: it took a block's end for its beginning."""
    wire = Wire()
    queue = FrameQueue(wire.send, clock, 0)
    queue.open()
    for number in range(20):
        queue.publish(str(number))
    await asyncio.sleep(0)
    queue.answer("first")
    await asyncio.sleep(0)
    assert wire.sent == ["0"]
    wire.gate.set()
    await settled(queue)
    assert wire.sent == ["0", "first", *map(str, range(1, 20))]
    assert wire.most == 1


async def test_app_of_threads_sees_frames_in_order(clock: LockstepClock) -> None:
    """Such an app handles pushes that are there at the same time in any order."""
    handled: list[str] = []
    later = threading.Event()

    def handle(push: pb.SendRequest, _: object) -> Iterator[pb.RecResponse]:
        if push.params == "0":
            later.wait(0.1)  # the thread of a later push is faster, if there is one
        handled.append(push.params)
        later.set()
        yield pb.RecResponse(nameCode=push.nameCode)

    method = grpc.unary_stream_rpc_method_handler(handle, pb.SendRequest.FromString, pb.RecResponse.SerializeToString)
    with ThreadPoolExecutor(2) as threads:
        server = grpc.server(threads)
        server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, {"sendMsg": method}),))
        line = AppLine(f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}", None)
        server.start()

        async def send(text: str) -> Delivery:
            return delivery(await line.push(2001, text))

        queue = FrameQueue(send, clock, 0)
        queue.open()
        for number in range(4):
            queue.publish(str(number))
        await until(lambda: len(handled) == 4)
        await settled(queue)
        await line.close()
        server.stop(None).wait()
    assert handled == ["0", "1", "2", "3"]


async def test_a_broken_connection_loses_nothing(clock: LockstepClock) -> None:
    wire = Wire()
    queue = FrameQueue(wire.send, clock, 0)
    queue.open()
    wire.gate.set()
    wire.outcome = Delivery.FAILED
    for number in range(20):
        queue.publish(str(number))
    await asyncio.sleep(0.01)
    assert wire.sent == []
    wire.outcome = Delivery.DONE
    await clock.advance(1.0)
    await settled(queue)
    assert wire.sent == [str(number) for number in range(20)]


async def test_returning_app_finds_answers_but_no_old_news(clock: LockstepClock) -> None:
    wire = Wire()
    queue = FrameQueue(wire.send, clock, 0)
    queue.answer("no one asked")
    await queue.drain_answers()
    queue.answer("early")
    queue.publish("missed")
    queue.open()
    wire.gate.set()
    await settled(queue)
    assert wire.sent == ["early"]
    queue.shut()
    queue.answer("late")
    await clock.advance(31.0)
    queue.answer("too late")
    queue.open()
    await settled(queue)
    assert wire.sent == ["early"]


async def test_programs_do_not_wait_for_an_unresponsive_app(clock: LockstepClock) -> None:
    wire = Wire()
    queue = FrameQueue(wire.send, clock, 0)
    queue.open()
    for number in range(2 * ROOM):
        queue.publish(str(number))
    waiting = asyncio.ensure_future(queue.drain())
    await asyncio.sleep(0.01)
    assert not waiting.done()
    wire.outcome = Delivery.SILENT
    wire.gate.set()
    await waiting
    wire.gate.clear()
    for number in range(2 * NEWS_MAX):
        queue.publish(str(number))
    assert queue._news <= NEWS_MAX
    queue.close()
