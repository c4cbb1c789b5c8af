"""A right that ends between a request's check and its effect: nothing happens any more."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import grpc
import pytest

from roboglot.access.store import AccessStore, Grant
from roboglot.model.admission import Forbidden
from roboglot.model.client_context import set_client
from roboglot.model.clock import LockstepClock
from roboglot.model.components.logistics.delivery import Delivery, OrderKind, OrderRequest, OrderStatus
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.operations import Right
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.runtime import Runtime
from roboglot.wire.cyberdog.codes import Code, FileError
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from tests.access.matrix import ADDRESS, app_of

MAY_ALL = frozenset({Right.PROGRAM, Right.EDIT})
GO = {"action_name": "slamtec.agent.actions.MoveToAction", "options": {"target": {"x": 3.0, "y": 0.0}}}
FILM = 64 << 20  # bytes; more than gRPC sends ahead
REST, CONSOLE = "/api/core/motion/v1/actions", "/api/robots/a/go_to"


@pytest.mark.parametrize(("path", "body"), [(REST, GO), (CONSOLE, {"points": [[3.0, 0.0]]})])
@pytest.mark.parametrize("rotated", [False, True])
async def test_request_completed_after_revocation_starts_nothing(
    runtime: Runtime, store: AccessStore, path: str, body: dict[str, object], rotated: bool
) -> None:
    token = store.add_machine("cell", [Grant("a", MAY_ALL)])
    assert runtime.guard is not None
    assert runtime.console is not None
    runtime.guard.reload()
    await runtime.console.ready()
    host, port = (ADDRESS, 1448) if path == REST else ("127.0.0.1", runtime.console.port)
    reader, writer = await asyncio.open_connection(host, port)
    whole = json.dumps(body).encode()
    head = f"POST {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}\r\nContent-Length: {len(whole)}"
    writer.write(f"{head}\r\nExpect: 100-continue\r\n\r\n".encode())
    assert b"100 Continue" in await reader.readuntil(b"\r\n\r\n")  # admitted: the body is being read
    if rotated:
        store.rotate("cell")
    else:
        store.revoke("cell")
    runtime.guard.reload()
    writer.write(whole)
    status = await reader.readline()
    assert status.split()[1] == b"401", status
    assert not runtime.fleet.robots["a"].actions.running()
    writer.close()


async def test_no_motion_begins_without_right_to_drive(runtime: Runtime, store: AccessStore) -> None:
    """However long passes between the request's check and the motion's start."""
    robot = runtime.fleet.robots["a"]
    store.add_machine("cell", [Grant("a", MAY_ALL)])
    assert runtime.guard is not None
    runtime.guard.reload()
    set_client("slamware cell", identity="cell")
    robot[Driving].move_by(Pose(0.1)).cancel("")
    store.revoke("cell")
    runtime.guard.reload()
    with pytest.raises(Forbidden, match="may no longer drive"):
        robot[Driving].move_by(Pose(0.1))


async def test_the_rest_of_a_file_is_kept_back(
    runtime: Runtime, store: AccessStore, data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.add_app("viewer", [Grant("a", MAY_ALL)])
    assert runtime.guard is not None
    runtime.guard.reload()
    film = tmp_path / "film.mp4"
    film.write_bytes(bytes(FILM))
    monkeypatch.setattr(CameraFiles, "path", lambda _files, _name: film)
    async with app_of(data / "cyberdog", "viewer") as stub:
        stream = stub.getFile(pb.SendRequest(nameCode=Code.SAVED_FILE, params='{"file_name": "film.mp4"}'))
        size = 0
        async for chunk in stream:
            if not size:
                store.revoke("viewer")
                runtime.guard.reload()
            size += len(chunk.buffer)
    assert chunk.error_code == FileError.CAMERA_SILENT
    assert 0 < size < FILM // 2


async def test_live_pictures_end(runtime: Runtime, store: AccessStore, data: Path) -> None:
    for name in ("viewer", "another"):
        store.add_app(name, [Grant("a", MAY_ALL)])
    assert runtime.guard is not None
    runtime.guard.reload()
    door = runtime.doors["a"].door("cyberdog")
    assert isinstance(door, CyberDogDoor)
    assert door._context is not None
    signal = {"uid": "phone", "c_sdp": {"candidate": "", "sdpMid": "0", "sdpMLineIndex": 0}}
    async with app_of(data / "cyberdog", "viewer") as stub:
        answers = stub.sendMsg(pb.SendRequest(nameCode=Code.VIDEO, params=json.dumps(signal)))
        assert [answer.data async for answer in answers] == [""]
    for loser, left in (("another", 1), ("viewer", 0)):
        store.revoke(loser)
        runtime.guard.reload()
        assert len(door._context.video._peers) == left


async def test_open_streams_end_with_the_right(runtime: Runtime, store: AccessStore, data: Path) -> None:
    """That of a task, too, which would say nothing more by itself."""
    for name in ("mapper", "another"):
        store.add_app(name, [Grant("a", MAY_ALL)])
    guard, clock = runtime.guard, runtime.clock
    assert guard is not None
    assert isinstance(clock, LockstepClock)
    guard.reload()
    async with app_of(data / "cyberdog", "mapper") as stub:
        answers = stub.sendMsg(pb.SendRequest(nameCode=Code.START_TASK, params=json.dumps({"type": 5})), timeout=60.0)
        first = json.loads((await anext(aiter(answers))).data)
        assert first == {"accepted": 1}
        store.revoke("another")
        guard.reload()
        store.revoke("mapper")
        guard.reload()
        rest = [json.loads(answer.data) async for answer in answers]
        assert rest[-1] == {"error_code": 322}
        assert await answers.code() is grpc.StatusCode.OK


@pytest.mark.slow  # in short: test_open_streams_end_with_the_right
async def test_orders_end_with_their_own_clients_right(runtime: Runtime, store: AccessStore) -> None:
    robot, clock = runtime.fleet.robots["a"], runtime.clock
    assert isinstance(clock, LockstepClock)
    assert runtime.guard is not None
    for name in ("anna", "ben"):
        store.add_machine(name, [Grant("a", MAY_ALL)])
    runtime.guard.reload()
    delivery = robot[Delivery]
    for name, x in (("near", 1.0), ("far", 2.5)):
        await robot[Places].put(PointOfInterest(name, Pose(x, 0.0), {"display_name": name}))
    for who in ("anna", "ben", "anna"):  # the first client's identity must not count for the others
        set_client(f"slamware {who}", identity=who)
        await delivery.accept(OrderRequest(OrderKind.GUIDE, "far" if who == "anna" else "near"))
    set_client("")
    await clock.advance(2.0)
    assert [action.identity for action in robot.actions.running()] == ["anna"]
    store.revoke("anna")
    runtime.guard.reload()
    await clock.advance(30.0)
    anna, ben, again = delivery.orders
    ended = [order.status for order in (anna, ben, again)]
    assert ended == [OrderStatus.CANCELED, OrderStatus.SUCCEEDED, OrderStatus.CANCELED]
    movers = dict.fromkeys(action.identity for action in robot.actions.history)
    assert list(movers) == ["anna", "ben", ""]  # it goes to rest by itself
