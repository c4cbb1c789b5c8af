"""Every operation of all catalogues, for every kind of caller, through every door: done by right, or not at all."""

from __future__ import annotations

import asyncio
import dataclasses
import functools
import json
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from roboglot.console.verbs.clock import CLOCK_VERBS
from roboglot.console.verbs.robots import VERBS
from roboglot.console.verbs.world import WORLD_VERBS
from roboglot.console.wire_log import rows
from roboglot.model.admission import Forbidden
from roboglot.model.client_context import set_client
from roboglot.operations import OperationTable, Right
from roboglot.programs.functions import prelude  # noqa: F401 - it fills the table
from roboglot.programs.functions import table as functions
from roboglot.programs.functions.session import Session
from roboglot.protocols.cyberdog.table import TABLE as DOG
from roboglot.protocols.foxglove.table import TABLE as VIEWER
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.robomaster.table import TABLE as TEXT
from roboglot.protocols.slamware.table import TABLE as REST
from roboglot.protocols.vda5050.config import Vda5050Config
from roboglot.protocols.vda5050.dispatch import answer
from roboglot.protocols.vda5050.order_book import ActionState
from roboglot.protocols.vda5050.server import Vda5050Door
from roboglot.protocols.vda5050.table import TABLE as FLEET
from roboglot.runtime import Runtime
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.codes import Code, FileError
from roboglot.wire.vda5050.orders import Action
from roboglot.wire.visual.requests import MODES, FrameSubject
from roboglot.wire.visual.requests import OPERATIONS as FRAMES
from tests.access.matrix import (
    ADDRESS,
    CALLERS,
    Caller,
    HttpCaller,
    TextCaller,
    dog_answers,
    dog_file_errors,
    frame_states,
    open_frames,
    rest_status,
    viewer_refusals,
)

REFUSED = (401, 403)
COLUMNS = [
    "number",
    "stamp",
    "door",
    "connection",
    "client",
    "direction",
    "operation",
    "status",
    "refusal",
    "ms",
    "bytes",
    "excerpt",
]
TABLES: tuple[tuple[str, OperationTable[Any], Callable[[str], object]], ...] = (
    ("slamware", REST, str),
    ("robomaster", TEXT, str),
    ("cyberdog", DOG, int),
)
CONSOLE_POSTS = (
    {f"robots/a/{operation.key}": operation.right for operation in VERBS}
    | {f"world/{operation.key}": operation.right for operation in (*WORLD_VERBS, *CLOCK_VERBS)}
    | {"class": Right.ADMIN, "recording": Right.ADMIN, "robots/a/wire/1/resend": Right.ADMIN}
    | {"robots/a/rehearse": Right.DRIVE, "robots/a/take_control": Right.DRIVE}
    | {"robots/a/program": Right.PROGRAM, "robots/a/camera/call": Right.SEE}
)
TARGETS = {"debug": "debug"}  # by the frame's fields; all others are free


@pytest.fixture
def reached(monkeypatch: pytest.MonkeyPatch) -> set[object]:
    """The keys whose handlers were reached since it was cleared; the handlers themselves are not run."""
    seen: set[object] = set()

    def stand_in(key: object, own: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(own)  # its parameters are still checked
        async def handler(*_: object, **__: object) -> None:
            seen.add(key)

        return handler

    for table in (REST, TEXT, DOG, VIEWER, FLEET):
        kept: dict[Any, Any] = table._operations
        for key, operation in list(kept.items()):
            monkeypatch.setitem(kept, key, dataclasses.replace(operation, handler=stand_in(key, operation.handler)))
    return seen


def may(caller: Caller, table: OperationTable[Any], key: object) -> bool:
    operation = table.get(key)
    return operation is not None and operation.right in caller.rights


async def test_rest_does_what_the_right_allows(runtime: Runtime, reached: set[object]) -> None:
    keys = [row.key for row in contract("slamware")]
    for caller in CALLERS:
        reached.clear()
        with closing(HttpCaller(caller.address, ADDRESS, 1448)) as client:
            statuses = {key: await rest_status(client, key) for key in keys}
        allowed = {key for key in keys if may(caller, REST, key)}
        assert reached <= allowed, caller.name
        assert {key for key in keys if statuses[key] not in (*REFUSED, 501)} == allowed, caller.name


async def test_the_text_protocol_does_what_the_right_allows(runtime: Runtime, reached: set[object]) -> None:
    keys = [operation.key for operation in TEXT]
    for caller in CALLERS:
        session = runtime_session(runtime)
        session.begin()
        reached.clear()
        client = await TextCaller.open(caller.address)
        for key in keys:
            await client.ask(key)
            session.active = True
        client.close()
        assert reached <= {key for key in keys if may(caller, TEXT, key)}, caller.name
        if Right.SEE in caller.rights:
            assert "robot battery ?" in reached
        if Right.DRIVE in caller.rights:
            assert {"quit", "blaster fire", "chassis stop"} <= reached


@pytest.mark.slow  # in short: test_cyberdog_checks_the_right_before_the_parameters
async def test_cyberdog_does_what_the_right_allows(runtime: Runtime, reached: set[object], data: Path) -> None:
    codes = [int(operation.key) for operation in DOG]
    for caller in CALLERS:
        reached.clear()
        answers = await dog_answers(data / "cyberdog", caller.name, codes)
        allowed = {code for code in codes if may(caller, DOG, code)}
        assert set(map(str, reached)) <= set(map(str, allowed)), caller.name
        for code in set(codes) - allowed:
            assert all(answer.get("error_code", 1) for answer in answers[code]), (caller.name, code)
        if Right.SEE in caller.rights:
            assert {10001, 1001} <= reached


async def test_cyberdog_checks_the_right_before_the_parameters(runtime: Runtime, data: Path) -> None:
    (caller,) = (caller for caller in CALLERS if caller.name == "see")
    codes = [int(operation.key) for operation in DOG if operation.right is not Right.SEE]
    forbidden = await dog_answers(data / "cyberdog", caller.name, codes)
    assert await dog_answers(data / "cyberdog", caller.name, codes, params="{no JSON") == forbidden


async def test_viewers_do_what_the_right_allows(runtime: Runtime, reached: set[object]) -> None:
    keys = {operation.key for operation in VIEWER}
    for caller in CALLERS:
        reached.clear()
        refused = await viewer_refusals(caller.address, sorted(keys))
        if refused is None:
            assert Right.SEE not in caller.rights
            assert not reached
            continue
        may_not = {key for key in keys if not may(caller, VIEWER, key)}
        assert not reached & may_not, caller.name
        assert refused == len(may_not), caller.name


async def test_fleet_control_does_what_its_right_allows(runtime: Runtime, reached: set[object]) -> None:
    door = Vda5050Door(runtime.fleet.robots["a"], Vda5050Config())
    keys = {operation.key for operation in FLEET}
    messages = {"order", "instantActions"}  # sent unprompted; all others are actions within

    async def ask(caller: Caller) -> set[str]:
        """Return the actions that were refused for want of a right."""
        await door._introduce(f"{caller.address}:1883")
        for name in messages:
            await answer(door._context, name, b"{}")
        states = {key: ActionState(Action(key, key)) for key in keys - messages}
        for key, state in states.items():
            await door._context.performer.perform(state, FLEET._operations[key], instant=True)
        return {key for key, state in states.items() if "has no right to" in state.result}

    for caller in CALLERS:
        reached.clear()
        refused = await asyncio.create_task(ask(caller))
        allowed = {key for key in keys if may(caller, FLEET, key)}
        assert refused == keys - allowed - messages, caller.name
        assert reached <= allowed, caller.name
        assert messages & reached == messages & allowed, caller.name


async def test_files_of_the_dog_need_rights(runtime: Runtime, data: Path) -> None:
    asked: list[tuple[int, dict[str, object]]] = [
        (Code.SAVED_FILE, {"file_name": "none.jpg"}),
        (Code.CAMERA, {"command": 9}),
    ]
    for caller in CALLERS:
        errors = await dog_file_errors(data / "cyberdog", caller.name, asked)
        refused = [error == FileError.CAMERA_SILENT for error in errors]
        assert refused == [Right.SEE not in caller.rights, Right.DRIVE not in caller.rights], caller.name


async def test_functions_of_programs_need_rights(runtime: Runtime, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: set[str] = set()
    kept = functions.ABILITIES._operations
    for key, operation in list(kept.items()):
        monkeypatch.setitem(kept, key, dataclasses.replace(operation, handler=_noting(seen, key)))
    monkeypatch.setattr(functions, "bind", lambda *_: {})
    for caller in CALLERS:
        seen.clear()
        refused: set[str] = set()
        session = Session(runtime.fleet.robots["a"], "t", host=None)  # type: ignore[arg-type]
        await asyncio.create_task(_call_all(caller, session, refused))
        allowed = {key for key, operation in kept.items() if operation.right in caller.rights}
        assert (seen, refused) == (allowed, kept.keys() - allowed), caller.name


async def _call_all(caller: Caller, session: Session, refused: set[str]) -> None:
    set_client("visual t", identity=caller.address)
    for key in functions.ABILITIES._operations:
        try:
            await functions.call(session, key, (), {})
        except Forbidden:
            refused.add(key)


def _noting(seen: set[str], key: str) -> Callable[..., Any]:
    async def handler(*_: object, **__: object) -> None:
        seen.add(key)

    return handler


@pytest.mark.slow  # in short: test_viewers_do_what_the_right_allows
async def test_the_console_does_what_the_right_allows(runtime: Runtime, monkeypatch: pytest.MonkeyPatch) -> None:
    assert runtime.console is not None
    await runtime.console.ready()
    for caller in CALLERS:
        with closing(HttpCaller(caller.address, "127.0.0.1", runtime.console.port)) as client:
            for path, right in CONSOLE_POSTS.items():
                for body in (b'{"no": "such value"}', b"{no JSON"):  # the right is checked before the body is read
                    status = await client.status("POST", f"/api/{path}", body)
                    assert (status in REFUSED) == (right not in caller.rights), (caller.name, path, status)


async def test_page_learns_nothing_of_others_world(runtime: Runtime) -> None:
    """The floor plans are the simulated world's truth, which needs the right to see all its robots."""
    assert runtime.console is not None
    await runtime.console.ready()
    for name in ("see", "owner-of-b"):
        address = next(caller.address for caller in CALLERS if caller.name == name)
        async with connect(f"ws://127.0.0.1:{runtime.console.port}/live", local_addr=(address, 0)) as page:
            hello = json.loads(await page.recv())
        assert bool(hello["robots"]) == bool(hello["doors"]) == bool(hello["floors"]) == (name == "see")


async def test_programs_do_what_the_right_allows(runtime: Runtime) -> None:
    frames: list[dict[str, object]] = [
        {
            "type": kind,
            "operate": operate,
            "target_id": [TARGETS.get(operate, "t")],
            "mode": "single" if kind is FrameSubject.TASK else "common",
            "condition": "now" if kind is FrameSubject.TASK else "m(x)",
            "body": "x = 1",
        }
        for kind in (FrameSubject.TASK, FrameSubject.MODULE)
        for operate in FRAMES[kind]
    ]
    frames += [
        {"type": kind, "operate": "inquiry", "target_id": [], "mode": mode}
        for kind in (FrameSubject.AI, FrameSubject.SLAM)
        for mode in sorted(MODES[kind])
    ]
    for caller in CALLERS:
        if (link := await open_frames(caller.address)) is None:
            assert Right.SEE not in caller.rights
            continue
        states = await frame_states(link, frames)
        await link.close()
        for frame, (_, words) in zip(frames, states, strict=True):
            right = Right.SEE if frame["operate"] == "inquiry" else Right.PROGRAM
            assert ("has no right" in words) == (right not in caller.rights), (caller.name, frame)


@pytest.mark.slow  # in short: test_page_learns_nothing_of_others_world
async def test_wire_view_shows_every_row_on_a_wire(runtime: Runtime, reached: set[object], data: Path) -> None:
    """Asks every door everything, as one who may do all and as one who may only see, and reads the console's feed."""
    assert runtime.console is not None
    wire = runtime.console._desk.views["a"].wire
    for name, caller in ((Right.ADMIN, CALLERS[5]), (Right.SEE, CALLERS[1])):
        wire.open()
        await ask_everything(runtime, caller, data)
        shown = [dict(zip(COLUMNS, row, strict=True)) for row in rows(wire.after(0, 10**6))]
        wire.close()
        wire.end()
        for door, table, key_of in TABLES:
            keys = {row.key for row in contract(door) if not row.key.startswith(">")}  # pushes need no right
            asked = [row["operation"] for row in shown if row["door"] == door and row["direction"] == "request"]
            assert sorted(asked) == sorted(keys), door
            answers = [row for row in shown if row["door"] == door and row["direction"] == "reply"]
            forbidden = {row["operation"] for row in answers if "has no right to" in row["refusal"]}
            may_not = {key for key in keys if table.get(key_of(key)) and not may(caller, table, key_of(key))}
            assert forbidden == may_not, (name, door)
            assert all(row["excerpt"] for row in answers if row["operation"] in forbidden)


async def ask_everything(runtime: Runtime, caller: Caller, data: Path) -> None:
    """Every row of the three catalogues whose operations go over a wire one by one."""
    with closing(HttpCaller(caller.address, ADDRESS, 1448)) as client:
        for row in contract("slamware"):
            await rest_status(client, row.key)
    session = runtime_session(runtime)
    session.begin()
    text = await TextCaller.open(caller.address)
    for row in (row for row in contract("robomaster") if not row.key.startswith(">")):
        await text.ask(row.key)
        session.active = True
    text.close()
    await dog_answers(data / "cyberdog", caller.name, [int(row.key) for row in contract("cyberdog")])


def runtime_session(runtime: Runtime) -> Any:
    """Return the text door's session of robot a."""
    return next(door.context for door in runtime.doors["a"]._doors if isinstance(door, RoboMasterDoor))
