"""Robots and their cloud: what is done on one is kept, reported in order, and comes to the others as favourites."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, cast

import pytest
import uvicorn
from hypothesis import given
from hypothesis import strategies as st

from roboglot.clients.errors import BadAnswer, ClientError, LinkLost, TimedOut
from roboglot.clients.visual.cloud import CloudLink
from roboglot.cloud.application import BackEnd
from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.mirror import CloudMirror
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.cloud import CloudStore
from roboglot.storage.database import Database
from roboglot.storage.outbox import OUTBOX_MAX, Outbox
from roboglot.storage.programs import program_stores
from roboglot.wire.visual.cloud import BadCloudAnswer, CloudAnswer, CloudCode, format_answer, parse_answer
from tests.protocols.visual.front_end import FrontEnd

HOST = "127.0.0.79"


class Cloud:
    """The reference back end on a socket, which can go away and come back."""

    def __init__(self, store: CloudStore) -> None:
        self.store = store
        self.port = 0
        self._server: uvicorn.Server | None = None
        self._serving: asyncio.Task[None] | None = None

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.port}"

    async def up(self) -> None:
        config = uvicorn.Config(BackEnd(self.store), host=HOST, port=self.port, lifespan="off", log_config=None)
        self._server = uvicorn.Server(config)
        self._serving = asyncio.create_task(self._server.serve())
        async with asyncio.timeout(60):
            while not self._server.started:  # noqa: ASYNC110
                await asyncio.sleep(0.005)
        self.port = self._server.servers[0].sockets[0].getsockname()[1]

    async def down(self) -> None:
        if self._server and self._serving:
            self._server.should_exit = True
            await self._serving
            self._server = None

    async def post(self, token: str, path: str = "/programs", method: str = "POST", **frame: Any) -> CloudAnswer:
        return await self.send(token, json.dumps(frame), path, method)

    async def send(self, token: str, body: str, path: str = "/programs", method: str = "POST") -> CloudAnswer:
        reader, writer = await asyncio.open_connection(HOST, self.port)
        bearer = f"Authorization: Bearer {token}\r\n" if token else ""
        data = body.encode()
        writer.write(f"{method} {path} HTTP/1.0\r\n{bearer}Content-Length: {len(data)}\r\n\r\n".encode() + data)
        answer = await asyncio.wait_for(reader.read(), 60)
        writer.close()
        return parse_answer(answer.partition(b"\r\n\r\n")[2])


@pytest.fixture
async def cloud() -> AsyncIterator[Cloud]:
    database = Database(":memory:")
    cloud = Cloud(CloudStore(database))
    await cloud.up()
    yield cloud
    await cloud.down()
    database.close()


class Robots:
    """Makes robots of one account."""

    def __init__(self, cloud: Cloud, engine: Engine, clock: LockstepClock, token: str) -> None:
        self.cloud, self.engine, self.clock, self.token = cloud, engine, clock, token
        self.closing: list[Any] = []

    async def robot(self, id: str, database: Database) -> FrontEnd:
        robot = Robot(id, cast(Description, None), self.clock)
        service = ProgramService(robot, self.engine, program_stores(database, robot.id))
        link = CloudLink(self.cloud.url, self.token, id)
        door = VisualDoor(service, cloud=CloudMirror(link, Outbox(database, id), self.clock, ClientError))
        await door.start()
        self.closing.append(door)
        return FrontEnd(door, service, self.clock)


@pytest.fixture
async def robots(cloud: Cloud, engine: Engine, clock: LockstepClock) -> AsyncIterator[Robots]:
    robots = Robots(cloud, engine, clock, await cloud.store.add_account("school"))
    yield robots
    for door in robots.closing:
        await door.close()


@pytest.fixture
def database() -> Any:
    opened = Database(":memory:")
    yield opened
    opened.close()


async def sent(app: FrontEnd, database: Database) -> None:
    """Wait until the outbox is empty."""
    box = Outbox(database, app.service.robot.id)
    async with asyncio.timeout(60):
        while await box.first() is not None:
            await asyncio.sleep(0.005)
            await app.clock.advance(1.0)


async def operations(robots: Robots) -> list[tuple[str, str]]:
    answer = await robots.cloud.post(robots.token, type="record", id="r", operate="inquiry", target_id=[])
    assert (answer.code, answer.request) == ("200", "r")
    return [(item["id"], item["operate"]) for item in answer.items]


async def test_favourites_of_one_robot_run_on_the_other(robots: Robots, database: Database) -> None:
    one = await robots.robot("one", database)
    module = {"type": "module", "mode": "common", "condition": "say()", "body": "print('from the cloud')"}
    # "a" calls "z": the first needs the last
    await one.ask("save", "z", **module)
    await one.ask("save", "a", **module | {"condition": "twice()", "body": "say()\nsay()"})
    await one.save("t1", "twice()")
    await one.save("t10", "print('not chosen')")
    await sent(one, database)
    for kind, id in (("task", "t1"), ("module", "z"), ("module", "a")):
        answer = await robots.cloud.post(robots.token, "/favourites", type=kind, id=id, favourite=True)
        assert answer.code == "200"
    two = await robots.robot("two", database)
    [listed] = await two.ask("inquiry")
    assert [(item["id"], item["operate"], item["dependent"]) for item in listed["list"]] == [("t1", "wait_run", ["a"])]
    assert [item["id"] for item in (await two.ask("inquiry", type="module"))[0]["list"]] == ["a", "z"]
    await two.ask("run", "t1")
    await two.ends("t1")
    assert await two.printed("t1") == ["from the cloud"] * 2


async def test_operations_are_recorded_in_order(robots: Robots, database: Database) -> None:
    app = await robots.robot("one", database)
    await app.save("t", "pass")
    await app.ask("run", "t")
    await app.ends("t")
    await app.ask("delete", "unknown")
    await app.ask("inquiry")
    await app.ask("run", "unknown")  # refused: neither done nor reported
    await sent(app, database)
    assert await operations(robots) == [("t", "run"), ("t", "start"), ("t", "stop")]


async def test_absent_cloud_is_reported_later_without_delay(robots: Robots, tmp_path: Path) -> None:
    await robots.cloud.down()
    database = Database(tmp_path / "robot.db")
    app = await robots.robot("one", database)
    await app.save("t", "pass")
    [listed] = await app.ask("inquiry")
    assert [item["id"] for item in listed["list"]] == ["t"]
    await app.ask("run", "t")
    await app.ends("t")
    await app.door.close()  # the robot is switched off before the cloud comes back
    await robots.cloud.up()
    app = await robots.robot("one", database)
    await app.ask("shutdown", "t")
    await sent(app, database)
    assert await operations(robots) == [
        ("t", "run"),
        ("t", "start"),
        ("t", "stop"),
        ("t", "shutdown"),
        ("t", "shutdown"),
    ]
    assert (await robots.cloud.post(robots.token, "/favourites", type="task", id="t")).code == "200"
    await app.door.close()
    database.close()


class Scripted:
    """A cloud that says what it is asked to."""

    def __init__(self, clock: LockstepClock, *answers: CloudAnswer | Exception) -> None:
        self.clock = clock
        self.answers = list(answers)
        self.frames: list[dict[str, Any]] = []
        self.times: list[float] = []

    async def post(self, frame: str) -> CloudAnswer:
        self.times.append(self.clock.time())
        self.frames.append(json.loads(frame))
        answer = self.answers.pop(0) if self.answers else CloudAnswer(CloudCode.OK, "", "")
        if isinstance(answer, Exception):
            raise answer
        return answer


def coded(code: CloudCode, *items: Any) -> CloudAnswer:
    return CloudAnswer(code, "", "", list(items))


async def test_temporary_failures_are_retried_at_growing_distances(database: Database, clock: LockstepClock) -> None:
    failures = (LinkLost("away"), TimedOut("slow"), coded(CloudCode.BROKEN), coded(CloudCode.REFUSED))
    link = Scripted(clock, *failures, coded(CloudCode.OK), coded(CloudCode.MISSING))
    mirror = CloudMirror(link, Outbox(database, "a"), clock, ClientError)
    mirror.start()
    for number in range(3):
        await mirror.send(json.dumps({"number": number}))
    async with asyncio.timeout(60):
        while len(link.frames) < 7:
            await asyncio.sleep(0.003)
            await clock.advance(0.25)
    assert [frame["number"] for frame in link.frames] == [0, 0, 0, 0, 0, 1, 2]  # 10001 is not retried
    gaps = [later - earlier for earlier, later in itertools.pairwise(link.times)]
    assert [gap >= expected for gap, expected in zip(gaps, (1, 2, 4, 8), strict=False)] == [True] * 4
    await mirror.close()


async def test_cloud_can_neither_overwrite_nor_run_nor_smuggle(engine: Engine, clock: LockstepClock) -> None:
    database = Database(":memory:")
    task = {"type": "task", "mode": "single", "condition": "now", "body": "print('cloud')", "describe": "", "style": ""}
    items = [
        task | {"id": "mine"},
        task | {"id": "new", "operate": "run"},
        task | {"id": "frame", "target_id": ["other"], "operate": "save"},
        task | {"id": "../etc"},
        task | {"id": "debug"},
        task | {"id": "wrong", "condition": "whenever"},
        task | {"id": "m", "type": "module"},
        {"type": "task"},
    ]
    link = Scripted(clock)
    service = ProgramService(Robot("a", cast(Description, None), clock), engine, program_stores(database, "a"))
    door = VisualDoor(service, cloud=CloudMirror(link, Outbox(database, "a"), clock, ClientError))
    await door.start()
    app = FrontEnd(door, service, clock)
    await app.save("mine", "print('mine')")
    await sent(app, database)
    assert door._cloud is not None
    await door._cloud.close()  # from here only inquiries reach the script
    link.answers = [coded(CloudCode.OK), coded(CloudCode.OK, *items)]
    [listed] = await app.ask("inquiry")
    assert [(i["id"], i["operate"]) for i in listed["list"]] == [
        ("mine", "wait_run"),
        ("new", "wait_run"),
        ("other", "wait_run"),
    ]
    kept = await service.get("mine")
    assert kept is not None
    assert kept.body == "print('mine')"
    asked = [frame for frame in link.frames if frame["operate"] == "inquiry"]
    assert [(frame["type"], frame["target_id"]) for frame in asked] == [("module", []), ("task", ["mine"])]
    await door.close()
    database.close()


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ({"path": "/else"}, "404"),
        ({"method": "GET"}, "405"),
        ({"type": "task", "operate": "save", "target_id": []}, "10001"),
        ({"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": ""}, "10001"),
        ({"type": "task", "target_id": ["t"]}, "10001"),
        ({"type": "task", "operate": "delete", "target_id": "t"}, "10001"),
        ({"type": "tusk", "operate": "inquiry", "target_id": []}, "404"),
        ({"type": "tusk", "operate": "delete", "target_id": ["t"]}, "404"),
        ({"type": "task", "operate": "delete", "target_id": ["t"]}, "200"),
        ({"path": "/favourites", "type": "task"}, "10001"),
        ({"path": "/favourites", "type": "task", "id": "t", "favourite": "no"}, "10001"),
        ({"path": "/favourites", "type": "task", "id": "t"}, "404"),
    ],
)
async def test_the_clouds_codes(cloud: Cloud, request_: dict[str, Any], code: str) -> None:
    token = await cloud.store.add_account("a")
    assert (await cloud.post(token, **request_)).code == code


async def test_only_accounts_come_in_and_see_their_own(cloud: Cloud) -> None:
    one, two = await cloud.store.add_account("one"), await cloud.store.add_account("two")
    assert (await cloud.post("", type="task")).code == "401"
    assert (await cloud.post("x", type="task")).code == "403"
    assert (await cloud.send(one, "[]")).code == "10001"
    assert (await cloud.send(one, "{" * 10_000)).code == "10001"
    task: dict[str, Any] = {"type": "task", "target_id": ["t"]}
    save = task | {"operate": "save", "mode": "single", "condition": "now", "body": "pass"}
    assert (await cloud.post(one, **save)).code == "200"
    assert (await cloud.post(two, "/favourites", type="task", id="t")).code == "404"
    assert (await cloud.post(one, "/favourites", type="task", id="t")).code == "200"
    inquiry: dict[str, Any] = {"type": "task", "operate": "inquiry", "target_id": []}
    assert [item["id"] for item in (await cloud.post(one, **inquiry)).items] == ["t"]
    assert (await cloud.post(two, **inquiry)).items == []
    assert (await cloud.post(one, **inquiry | {"target_id": ["t"]})).items == []  # incremental
    delete = task | {"operate": "delete"}
    assert (await cloud.post(one, **delete)).code == "200"
    assert [item["id"] for item in (await cloud.post(one, **inquiry)).items] == ["t"]  # favourites stay
    new = await cloud.store.add_account("one")
    assert (await cloud.post(one, **inquiry)).code == "403"
    assert len((await cloud.post(new, **inquiry)).items) == 1


async def test_address_that_is_no_cloud_is_reported_plainly(cloud: Cloud) -> None:

    async def chatty(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"{}")
        writer.write(words.pop(0))
        writer.close()

    server = await asyncio.start_server(chatty, HOST, 0)
    link = CloudLink(f"http://{HOST}:{server.sockets[0].getsockname()[1]}", "t", "a")
    words = [b"HTTP/1.1 200 OK\r\n\r\nhello", b"220 mail"]
    for message in ("no answer of a cloud", "does not speak HTTP"):
        with pytest.raises(BadAnswer, match=message):
            await link.post("{}")
    server.close()
    await server.wait_closed()
    await cloud.down()
    with pytest.raises(LinkLost, match="cannot be reached"):
        await CloudLink(cloud.url, "t", "a").post("{}")
    for url, token in (("ftp://x", "t"), ("http://", "t"), ("http://x", "a\r\nb")):
        with pytest.raises(ValueError, match=r"cloud's address|token"):
            CloudLink(url, token, "a")


async def test_silent_cloud_is_given_up(clock: LockstepClock) -> None:
    connected = asyncio.Event()

    async def silent(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        connected.set()
        await reader.read()
        writer.close()

    server = await asyncio.start_server(silent, HOST, 0)
    link = CloudLink(f"http://{HOST}:{server.sockets[0].getsockname()[1]}", "t", "a", clock)
    asking = asyncio.create_task(link.post("{}"))
    await asyncio.wait_for(connected.wait(), 60)
    await clock.advance(3.1)
    with pytest.raises(TimedOut):
        await asking
    server.close()
    await server.wait_closed()


TEXTS = st.recursive(st.none() | st.integers() | st.text(), st.lists).map(json.dumps)


@given(st.binary(max_size=60) | TEXTS.map(str.encode))
def test_any_bytes_are_an_answer_or_refused(body: bytes) -> None:
    try:
        answer = parse_answer(body)
    except BadCloudAnswer:
        return
    assert isinstance(answer.items, list)


def test_answers_are_read_as_written() -> None:
    body = format_answer(CloudCode.OK, "好", "1", [{"id": "t"}])
    assert json.loads(body) == {"code": "200", "message": "好", "request_id": "1", "data": [{"id": "t"}]}
    assert parse_answer(body).items == [{"id": "t"}]
    assert "data" not in json.loads(format_answer(CloudCode.BROKEN, "", "1"))
    for bad in (
        '{"code": "201", "message": "", "request_id": ""}',
        '{"code": "200", "message": "", "request_id": "", "data": [1]}',
    ):
        with pytest.raises(BadCloudAnswer):
            parse_answer(bad.encode())


async def test_the_outbox_keeps_the_newest_of_each_robot(database: Database) -> None:
    box, other = Outbox(database, "a"), Outbox(database, "b")
    await other.put("other")
    database.run_now(
        lambda c: c.executemany(
            "INSERT INTO cloud_outbox (robot, document) VALUES ('a', ?)", [(str(i),) for i in range(OUTBOX_MAX)]
        )
    )
    await box.put("last")
    first = await box.first()
    assert first is not None
    assert first[1] == "1"
    await box.remove(first[0])
    assert (await box.first() or (0, ""))[1] == "2"
    assert (await other.first() or (0, ""))[1] == "other"
