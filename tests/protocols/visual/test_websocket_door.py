"""Frames over a WebSocket: the same as over any carrier, and no one from outside who should not be there."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from websockets.frames import Frame, Opcode

from roboglot.clients.errors import BadAnswer, LinkLost
from roboglot.clients.visual import TextLink
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols import websocket_writer
from roboglot.protocols.visual.config import VisualConfig
from roboglot.protocols.visual.server import VisualDoor
from roboglot.protocols.websocket import CONNECTIONS_MAX
from roboglot.protocols.websocket_opening import MESSAGE_MAX, OPENING_MAX
from roboglot.protocols.websocket_writer import UNSENT_MAX
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from tests.narrowing import of_kind

HOST = "127.0.0.77"
LOOKS_MAX = 3000  # each takes 10 ms, and longer where the machine is busy


@pytest.fixture
async def door(plain_robot: Robot, engine: Engine) -> AsyncIterator[VisualDoor]:
    database = Database(":memory:")
    config = VisualConfig(port=0, origins=("https://studio.example",))
    door = VisualDoor(ProgramService(plain_robot, engine, program_stores(database, plain_robot.id)), HOST, config)
    await door.start()
    yield door
    await door.close()
    database.close()


@pytest.fixture
def address(door: VisualDoor) -> str:
    [endpoint] = door.endpoints
    return endpoint.address.removesuffix("/programs")


async def ask(link: TextLink, **fields: Any) -> dict[str, Any]:
    await link.send(json.dumps(fields))
    async for text in link:
        frame = json.loads(text)
        answer: dict[str, Any] = frame.get("feedback") or frame["response"]
        if answer["id"] == fields["id"]:
            return answer
    raise AssertionError("the robot went away")


async def test_a_program_is_saved_run_and_watched(address: str) -> None:
    link, log = await TextLink.open(address, "/programs"), await TextLink.open(address, "/log")
    body = "cyberdog.task.block('b')\nprint('hello', '狗' * 70000)"
    save = {"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now"}
    assert (await ask(link, id="1", body=body, **save))["state"] == 0
    assert (await ask(link, id="2", type="task", operate="run", target_id=["t"]))["state"] == 0
    operations = []
    async for text in link:
        operations.append(json.loads(text)["feedback"]["operate"])
        if operations[-1] == "stop":
            break
    assert operations == ["start", "run", "run", "stop"]
    printed = json.loads(await anext(log))
    assert (printed["target_id"], printed["level"], printed["text"][:7]) == ("t", "print", "hello 狗")
    await log.send("t")  # its record, now that it is over
    assert json.loads(await anext(log))["text"].startswith("hello 狗")
    assert json.loads(await anext(log)) == {"target_id": "t", "entries": 1}
    await link.close()
    await log.close()


async def test_a_program_is_halted_and_stepped_through(address: str) -> None:
    link, debug = await TextLink.open(address, "/programs"), await TextLink.open(address, "/debug")

    async def wish(operate: str, **fields: Any) -> dict[str, Any]:
        await debug.send(json.dumps({"target_id": "t", "operate": operate} | fields))
        answer: dict[str, Any] = json.loads(await anext(debug))
        return answer

    async def until(operate: str) -> None:
        async for text in link:
            frame = json.loads(text)["feedback"]
            if frame["operate"] == operate and frame["id"].startswith("task_"):
                return

    assert "no task" in (await wish("break", lines=[2]))["error"]
    body = "n = 1\nn = mod(n)\nwhile n:\n    n -= 1\ncyberdog.task.block('b')\nn = 7\nwhile True:\n    n += 1\n"
    module = {"type": "module", "operate": "save", "target_id": ["m"], "mode": "common", "condition": "mod(a)"}
    assert (await ask(link, id="0", body="a += 1\nreturn a\n", **module))["state"] == 0
    save = {"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now"}
    assert (await ask(link, id="1", body=body, **save))["state"] == 0
    assert (await wish("break", lines=[2], modules={"mod": [2]}, blocks=["b"]))["error"] == ""
    assert (await ask(link, id="2", type="task", operate="run", target_id=["t"]))["state"] == 0
    await until("suspend")
    where = {"error": "", "state": "suspend", "line": 2, "module": "", "block": "", "watched": True}
    assert await wish("where") == {"target_id": "t", "operate": "where"} | where
    await wish("step")
    await until("suspend")
    assert [(await wish("where"))[key] for key in ("line", "module")] == [1, "mod"]
    await wish("go")
    await until("suspend")
    assert [(await wish("where"))[key] for key in ("line", "module")] == [2, "mod"]
    await wish("go")
    await until("suspend")  # at the block
    assert [(await wish("where"))[key] for key in ("line", "block")] == [5, "b"]
    await wish("go")
    assert (await wish("where"))["state"] == "run"
    assert (await wish("step"))["error"] == ""  # in the busy loop
    await until("suspend")
    assert (await wish("where"))["line"] in (6, 7, 8)
    assert (await ask(link, id="3", type="task", operate="shutdown", target_id=["t"]))["state"] == 0
    assert "illegal" in (await wish("step"))["error"]
    await link.close()
    await debug.close()


async def test_program_at_full_speed_is_not_stepped_through(address: str) -> None:
    link, debug = await TextLink.open(address, "/programs"), await TextLink.open(address, "/debug")
    save = {"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now"}
    assert (await ask(link, id="1", body="while True:\n    pass\n", **save))["state"] == 0
    assert (await ask(link, id="2", type="task", operate="run", target_id=["t"]))["state"] == 0
    for operate in ("step", "break"):
        await debug.send(json.dumps({"target_id": "t", "operate": operate}))
        assert "full speed" in json.loads(await anext(debug))["error"]
    for nonsense in (
        "",
        "[]",
        "{",
        '{"target_id": "t", "operate": "fly"}',
        '{"target_id": "t", "operate": "break", "lines": [0]}',
    ):
        await debug.send(nonsense)
        assert json.loads(await anext(debug))["error"]
    await link.close()
    await debug.close()


async def test_everybody_hears_everything_and_the_robot_says_goodbye(door: VisualDoor, address: str) -> None:
    one, two = await TextLink.open(address, "/programs"), await TextLink.open(address, "/programs")
    await one.send("{")
    assert json.loads(await anext(one)) == json.loads(await anext(two))
    await one.close()
    await door.close()
    assert [text async for text in two] == []
    await two.close()
    with pytest.raises(LinkLost):
        await TextLink.open(address, "/programs")


async def raw(address: str, request: str) -> bytes:
    host, _, port = address.removeprefix("ws://").partition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(request.encode("latin-1"))
    answer = await reader.read(1000)
    writer.close()
    return answer


UPGRADE = (
    "GET {path} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nOrigin: {origin}\r\n\r\n"
)


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        ("http://127.0.0.77:8080", 101),
        ("https://studio.example", 101),
        ("https://evil.example", 403),
        ("http://127.0.0.7", 403),
        ("null", 403),
        ("", 403),
    ],
)
async def test_only_pages_of_this_host_may_come_in(address: str, origin: str, status: int) -> None:
    host = address.removeprefix("ws://")
    answer = await raw(address, UPGRADE.format(path="/programs", host=host, origin=origin))
    assert answer.startswith(f"HTTP/1.1 {status} ".encode())
    assert (b"s3pPLMBiTxaQ9kYGzzhZRbK+xOo=" in answer) is (status == 101)


async def test_plain_http_is_refused(address: str) -> None:
    with pytest.raises(BadAnswer, match="404"):
        await TextLink.open(address, "/else")
    assert b" 426 " in await raw(address, "GET /programs HTTP/1.1\r\nHost: x\r\n\r\n")
    missed = await raw(address, "GET /program HTTP/1.1\r\nHost: x\r\n\r\n")
    assert b"'/program': this port has WebSockets at /programs, /log, /where, /runs and /debug" in missed
    assert b" 431 " in await raw(address, "GET /programs HTTP/1.1\r\nX: " + "x" * OPENING_MAX)
    assert await raw(address, "nonsense\r\nnonsense\r\n\r\n") == b""


def encode(opcode: Opcode, data: bytes, *, fin: bool = True, masked: bool = True) -> bytes:
    """Return a client's frame."""
    return Frame(opcode, data, fin).serialize(mask=masked)


async def opened(address: str, path: str = "/programs") -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Return a WebSocket whose bytes a test writes itself."""
    host = address.removeprefix("ws://")
    reader, writer = await asyncio.open_connection(*host.split(":"))
    writer.write(UPGRADE.format(path=path, host=host, origin=f"http://{host}").encode())
    assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
    return reader, writer


BROKEN = {
    "binary": (encode(Opcode.BINARY, b"x"), 1003),
    "not UTF-8": (encode(Opcode.TEXT, b"\xff"), 1007),
    "unmasked": (encode(Opcode.TEXT, b"x", masked=False), 1002),
    "reserved bit": (b"\xc1\x80" + bytes(4), 1002),
    "unknown opcode": (b"\x83\x80" + bytes(4), 1002),
    "continues nothing": (encode(Opcode.CONT, b"x"), 1002),
    "text within a text": (encode(Opcode.TEXT, b"x", fin=False) + encode(Opcode.TEXT, b"x"), 1002),
    "ping in pieces": (b"\x09\x80" + bytes(4), 1002),
    "long ping": (b"\x89\xfe\x00\x80" + bytes(132), 1002),
    "announces too much": (b"\x81\xff" + b"\x7f" + b"\xff" * 11, 1009),
    "pieces add up to too much": (
        encode(Opcode.TEXT, bytes(MESSAGE_MAX // 2), fin=False)
        + b"\x80\xff"
        + (MESSAGE_MAX // 2 + 1).to_bytes(8, "big")
        + bytes(4),
        1009,
    ),
}


@pytest.mark.parametrize("case", BROKEN)
async def test_broken_frames_close_with_their_code(address: str, case: str) -> None:
    data, code = BROKEN[case]
    reader, writer = await opened(address)
    writer.write(data)
    answer = await reader.read()
    assert answer[:1] == b"\x88"
    assert int.from_bytes(answer[2:4], "big") == code
    writer.close()


async def test_pings_are_answered_and_connections_are_counted(address: str) -> None:
    reader, writer = await opened(address, "/log")
    links = [await TextLink.open(address, "/log") for _ in range(CONNECTIONS_MAX - 1)]
    writer.write(encode(Opcode.PING, b"?"))
    assert await reader.readexactly(3) == encode(Opcode.PONG, b"?", masked=False)
    with pytest.raises(LinkLost):
        await TextLink.open(address, "/log")
    writer.close()
    for link in links:
        await link.close()
    await (await TextLink.open(address, "/log")).close()


async def test_texts_in_pieces_are_joined_around_pings(address: str) -> None:
    reader, writer = await opened(address, "/where")
    pieces = [(Opcode.TEXT, b"ta", False), (Opcode.PING, b"?", True), (Opcode.CONT, b"sk", True)]
    data = b"".join(encode(opcode, piece, fin=fin) for opcode, piece, fin in pieces)
    for byte in data:
        writer.write(bytes([byte]))
    assert await reader.readexactly(3) == encode(Opcode.PONG, b"?", masked=False)
    head = await reader.readexactly(2)
    assert head[0] == 0x81
    assert json.loads(await reader.readexactly(head[1]))["target_id"] == "task"
    writer.close()


async def test_frames_behind_the_request_are_read(address: str) -> None:
    host = address.removeprefix("ws://")
    reader, writer = await asyncio.open_connection(*host.split(":"))
    request = UPGRADE.format(path="/where", host=host, origin=f"http://{host}").encode()
    writer.write(request + encode(Opcode.TEXT, b"task"))
    await reader.readuntil(b"\r\n\r\n")
    head = await reader.readexactly(2)
    assert json.loads(await reader.readexactly(head[1]))["target_id"] == "task"
    writer.close()


async def test_position_of_a_program(address: str) -> None:
    link, where = await TextLink.open(address, "/programs"), await TextLink.open(address, "/where")

    async def place(task: str) -> tuple[str, int, str, str]:
        await where.send(task)
        found = json.loads(await anext(where))
        assert found["target_id"] == task
        return found["state"], found["line"], found["module"], found["block"]

    async def reached(condition: Callable[[tuple[str, int, str, str]], bool]) -> tuple[str, int, str, str]:
        for _ in range(LOOKS_MAX):  # the other end sends nothing unprompted
            if condition(found := await place("t")):
                return found
            await asyncio.sleep(0.01)
        raise AssertionError(found)

    assert await place("t") == ("null", 0, "", "")
    module = {"type": "module", "operate": "save", "target_id": ["m"], "mode": "common", "condition": "hang()"}
    assert (await ask(link, id="0", body="x = 1\nwhile x:\n    pass", **module))["state"] == 0
    body = "cyberdog.task.block('b')\n\ncyberdog.task.breakpoint_block('c')\nhang()"
    save = {"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now"}
    assert (await ask(link, id="1", body=body, **save))["state"] == 0
    assert (await ask(link, id="2", type="task", operate="run", target_id=["t"]))["state"] == 0
    await reached(lambda found: found[0] == "suspend")
    assert await place("t") == ("suspend", 3, "", "c")
    assert (await ask(link, id="3", type="task", operate="recover", target_id=["t"]))["state"] == 0
    found = await reached(lambda found: found[2] == "hang" and found[1] >= 2)
    assert found[0] == "run"
    assert found[1] in (2, 3)
    await ask(link, id="4", type="task", operate="shutdown", target_id=["t"])
    await link.close()
    await where.close()


async def test_clients_that_do_not_read_are_cut_off(door: VisualDoor, address: str) -> None:
    reading, (_, asleep) = await TextLink.open(address, "/programs"), await opened(address)
    of_kind(asleep.transport, asyncio.Transport).pause_reading()
    text = "x" * (UNSENT_MAX + 1)
    door._front_ends.publish(text)
    assert await anext(reading) == text
    for _ in range(2):
        door._front_ends.publish(text)
        assert await anext(reading) == text
    assert door._socket is not None
    async with asyncio.timeout(60):
        while len(door._socket.connections) > 1:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    await reading.close()
    asleep.close()


LINES = 4000  # of 3 kB: more than a socket's buffer, less than a program may print
DOGS = "狗" * 990
PRINTING = f"for i in range({LINES} // 40):\n    print('\\n'.join(str(40 * i + k) + '{DOGS}' for k in range(40)))"


async def started_printing(address: str) -> TextLink:
    link = await TextLink.open(address, "/programs")
    save = {"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now"}
    assert (await ask(link, id="1", body=PRINTING, **save))["state"] == 0
    assert (await ask(link, id="2", type="task", operate="run", target_id=["t"]))["state"] == 0
    return link


@pytest.mark.slow
async def test_program_waits_for_slow_reader_of_its_log(
    door: VisualDoor, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(websocket_writer, "UNSENT_MAX", 1024 * 1024)
    monkeypatch.setattr(websocket_writer, "STALLED_SECONDS_MAX", 600.0)
    slow = await TextLink.open(address, "/log")
    written: list[str] = []
    door._service.log_entries.join(lambda _, entry: written.append(entry.text))
    link = await started_printing(address)
    assert door._socket is not None
    async with asyncio.timeout(60):
        while all(connection.writer.has_room for connection in door._socket.connections):  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    assert len(written) < LINES
    read = [json.loads(await anext(slow))["text"] for _ in range(LINES)]
    assert read == [f"{number}{DOGS}" for number in range(LINES)]
    await slow.close()
    await link.close()


async def test_a_program_waits_only_for_readers_that_read(
    door: VisualDoor, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(websocket_writer, "STALLED_SECONDS_MAX", 0.2)
    _, asleep = await opened(address, "/log")
    of_kind(asleep.transport, asyncio.Transport).pause_reading()
    link = await started_printing(address)
    async for text in link:
        if json.loads(text)["feedback"]["operate"] == "stop":
            break
    await link.close()
    asleep.close()


async def test_program_waiting_for_a_reader_can_be_ended(
    door: VisualDoor, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(websocket_writer, "STALLED_SECONDS_MAX", 600.0)
    _, asleep = await opened(address, "/log")
    of_kind(asleep.transport, asyncio.Transport).pause_reading()
    link = await started_printing(address)
    assert door._socket is not None
    async with asyncio.timeout(60):
        while all(connection.writer.has_room for connection in door._socket.connections):  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    assert (await ask(link, id="3", type="task", operate="shutdown", target_id=["t"]))["state"] == 0
    await link.close()
    asleep.close()
