"""Every code of the contract once through the client, against our own door."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from typing import Any

import msgspec
import pytest

from roboglot.clients.cyberdog import CyberDogClient, CyberDogRefused, TaskFailed, TaskStopped, values
from roboglot.clients.errors import LinkLost
from roboglot.model.components.system.bluetooth import Bluetooth
from roboglot.model.geometry import Point, Pose
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.table import pushes
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.chapters.camera import End
from roboglot.wire.cyberdog.codes import Code, SkinMode, TaskType
from tests.narrowing import known
from tests.protocols.cyberdog.phone import context_of

pytestmark = pytest.mark.world("office", body="cyberdog2")
BRACELET = values.Device("C4:7C:8D:00:00:01", "Bracelet", "random")
MODULES = [{"product": "l91", "device": "l91.NX", "module": "l91.NX.OTA", "latest": {"version": "9", "packages": []}}]

# In this order: a method of the client, what it is called with, and the robot's number if it refuses.
TABLE: tuple[tuple[str, tuple[Any, ...], int | None], ...] = (
    ("information", (), None),
    ("status", (), None),
    ("switch_nickname", (True,), None),
    ("set_nickname", ("豆豆", "豆豆豆豆"), None),
    ("set_volume", (40,), None),
    ("set_volume", (400,), 0),
    ("set_microphone", (True,), None),
    ("set_voice_control", (False,), None),
    ("set_eye_light", (30,), None),
    ("stop_sound", (), None),
    ("add_member", ("eva",), None),
    ("add_member", ("eva",), 0),
    ("members", (), None),
    ("member", ("eva",), None),
    ("member", ("adam",), 121),
    ("synchronise_members", (), None),
    ("rename_member", ("eva", "ewa"), None),
    ("audio_identity", (), None),
    ("set_audio_token", ("7", "access", "fresh", 3600), None),
    ("train_voice", ("ewa", "p1"), None),
    ("cancel_voice", (), None),
    ("send_voiceprints", ("[]",), None),
    ("enter_face", ("ewa",), None),
    ("change_faces", (1, "ewa"), None),
    ("recognise_faces", ("ewa",), None),
    ("remove_member", ("ewa",), None),
    ("end_video", ("unknown",), None),
    ("photo", (), None),
    ("keep_photo", (), None),
    ("record", (), None),
    ("record", (), 4),
    ("keep_recording", (), None),
    ("stop_recording", (), 5),
    ("saved_file", ("20200101_000000.jpg",), 9),
    ("update_status", (), None),
    ("update_progress", (), None),
    ("update_time", (), None),
    ("download_update", (MODULES,), 5710),
    ("install_update", ("0" * 32,), 5703),
    ("update", ("inquire",), None),
    ("update", ("remove",), 5703),
    ("update", ("format",), 2),
    ("join_update", (), 3),
    ("enable_skin", (True,), None),
    ("set_skin", (SkinMode.FLASH, 500), None),
    ("set_skin", (SkinMode.FLASH, 0), 0),
    ("stand", (), None),
    ("servo_frame", (303, 0.1, 0.0, 0.0), None),
    ("end_servo", (), None),
    ("perform", (400,), 3031),
    ("end_stair_alignment", (), None),
    ("delete_map", ("nowhere",), 1),
    ("choose_target", (values.Region(0, 0, 9, 9),), 0),
    ("stop_task", (TaskType.ALL,), None),
    ("join", (TaskType.NAVIGATION,), 3),
    ("navigate", (1.0, 0.0), 2),
    ("scan_bluetooth", (1.0,), None),
    ("bluetooth_history", (), None),
    ("connect_bluetooth", (BRACELET,), None),
    ("bluetooth_connected", (), None),
    ("bluetooth_firmware", (), None),
    ("bluetooth_battery", (), None),
    ("set_gear", (1,), None),
    ("gear", (), None),
    ("update_bluetooth", (), None),
    ("disconnect_bluetooth", (), None),
    ("forget_bluetooth", (), None),
    ("unlock", ("https://keys.example/other",), 2),
    ("leave_low_power", (), None),
    ("set_automatic_low_power", (False,), None),
    ("set_work_environment", ("test",), None),
    ("upload_log", (), None),
    ("calibrate_legs", (True,), None),
    ("get_map", (), None),
    ("reboot", (), None),
    ("disconnect_app", (), None),
)


@pytest.fixture
def asked(client: CyberDogClient, monkeypatch) -> set[int]:
    """The codes that the client sent."""
    codes: set[int] = set()
    send, fetch = client.link.send, client.link.fetch

    def sent(code: int, text: str) -> AsyncIterator[tuple[int, str]]:
        codes.add(int(code))
        return send(code, text)

    def fetched(code: int, text: str) -> AsyncIterator[Any]:
        codes.add(int(code))
        return fetch(code, text)

    monkeypatch.setattr(client.link, "send", sent)
    monkeypatch.setattr(client.link, "fetch", fetched)
    return codes


@pytest.mark.slow  # in short: test_every_push_arrives_as_its_value
async def test_every_code_of_the_contract_once(client, door: CyberDogDoor, robot, world, asked: set[int]) -> None:
    world.stage.place("a", Pose(9.0, 6.0))
    gadget = world.gadgets.get(BRACELET.mac)
    gadget.wearer, gadget.place = None, Point(9.5, 6.5)
    await client.found()
    outcomes = [(name, arguments, await outcome(client, name, arguments)) for name, arguments, _ in TABLE]
    assert outcomes == list(TABLE)
    pushed = {int(code) for code in pushes}
    assert {int(row.key) for row in contract("cyberdog")} <= asked | pushed
    assert robot[Bluetooth].connected is None
    reported = list[tuple[str, float]]()
    assert await client.update("reset", on_feedback=lambda *how: reported.append(how)) == {}
    assert reported == [("idle", 0.0)]


async def outcome(client: CyberDogClient, name: str, arguments: tuple[Any, ...]) -> int | str | None:
    try:
        await getattr(client, name)(*arguments)
    except CyberDogRefused as error:
        return error.code if error.words else "no words"
    return None


EXAMPLES: dict[int, values.Value] = {
    1003: values.ServoResponse(303, True, 0, 0, 100, 7),
    2001: values.ProgramFrame({"id": "1", "state": 0}),
    3013: values.VoiceTrained(0, "p1"),
    3014: values.VoiceprintsWanted(),
    4003: values.FilesLeft(["a.jpg"]),
    4005: values.DiskLow(5),
    5001: values.UpdateStatus("idle", 0),
    5005: values.UpdateProgress(10, 0, 0),
    5007: values.UpdateReboots(),
    5008: values.UpdateResult(True, 0),
    6001: values.Grid(0.05, 2, 1, 0.5, -0.5, [0, -1]),
    6005: values.Pose(1.0, 2.0),
    6006: values.PlannedPath([values.XY(1.0, 2.0)]),
    6007: values.Tracking([], values.Region(0, 0, 0, 0)),
    6011: values.LaserPoints([values.XY(1.5, 2.0)]),
    7003: values.FaceEntered(0, "eva"),
    7004: values.FaceRecognised("eva", 0, 1, 30.0, 1.0),
    8003: values.BluetoothLost(True),
    8008: values.BluetoothUpdateOffered("1 2"),
    8010: values.BluetoothUpdateProgress(1, 0.5, ""),
    8012: values.GearChanged(2),
}


async def test_every_push_arrives_as_its_value(client: CyberDogClient, door: CyberDogDoor) -> None:
    assert {int(code) for code in pushes} - {int(Code.VIDEO)} == EXAMPLES.keys()
    await client.found()
    await _until(lambda: context_of(door).app.connected)
    for code, value in EXAMPLES.items():
        with client.watch(type(value)) as reported:
            context_of(door).app.push(pushes[code], msgspec.to_builtins(value))
            async with asyncio.timeout(60):
                assert await anext(reported) == value
    with client.signals.subscribe() as signals:
        context_of(door).app.push(pushes[Code.VIDEO], {"is_closed": True, "uid": "x"})
        async with asyncio.timeout(60):
            assert await anext(signals) == End("x", done=True)


async def test_tasks_are_awaited_reported_and_cancelled(client: CyberDogClient, door, world) -> None:
    await client.found()
    reported: list[int] = []
    await (await client.relocalise(on_feedback=reported.append))
    assert reported[-1] == 3108
    begun = world.truth.pose_of("a")
    with client.watch(values.Pose) as poses:
        await (await client.navigate(1.0, 0.3, on_feedback=reported.append))
        pose = poses.drain()[-1]
    assert reported[-1] == 308
    reached = begun.compose(Pose(pose.px, pose.py, 2 * math.atan2(pose.qz, pose.qw)))
    assert reached.distance_to(world.truth.pose_of("a")) < 0.2
    far = await client.navigate(3.0, 0.0)
    far.leave()  # takes the stream back from another client: the end could fall between the two
    joined = await client.join(TaskType.NAVIGATION)
    with pytest.raises(CyberDogRefused, match="not accepted"):
        await client.charge()
    await joined.cancel()
    with pytest.raises(TaskStopped) as stopped:
        await joined
    assert stopped.value.result == 5
    with pytest.raises(TaskFailed):
        await (await client.navigate(400.0, 400.0))
    await client.stop_task()


async def test_a_joystick_walks_and_stops_with_its_block(client: CyberDogClient, door, world) -> None:
    await client.found()
    await client.stand()
    begun = world.truth.pose_of("a")
    with client.watch(values.ServoResponse) as responses:
        async with client.servo(303) as joystick:
            joystick.set(0.3, 0.0, 0.0)
            await _until(lambda: world.truth.pose_of("a").distance_to(begun) > 0.3)
        assert {response.code for response in responses.drain()} == {0}
    await asyncio.sleep(0.3)
    stood = world.truth.pose_of("a")
    await asyncio.sleep(0.2)
    assert world.truth.pose_of("a").distance_to(stood) < 0.02


async def test_files_come_whole_with_their_share(client: CyberDogClient, door) -> None:
    shares: list[float] = []
    photo = await client.photo(shares.append)
    assert photo.name.endswith(".jpg")
    assert photo.data[:2] == b"\xff\xd8"
    assert shares[-1] == 1.0


async def test_pictures_move(client: CyberDogClient, door, world) -> None:
    await client.found()
    await _until(lambda: door._context.app.connected)
    async with asyncio.timeout(60), client.video() as pictures:
        first = await pictures.next()
        await pictures.next()
    assert (first.width, first.height) == (1280, 720)
    await _until(lambda: door._context.video.viewers == 0)


async def test_dead_link_is_reported_at_once_and_mends(client: CyberDogClient, door: CyberDogDoor) -> None:
    await client.found()
    port = door.port
    await known(door._server).stop(None)
    with pytest.raises(LinkLost):
        await client.status()
    again = type(door)(
        door._robot, door._address, type(door._config)(port=port, app_port=door._config.app_port), door._data
    )
    await again.start()
    try:
        async with asyncio.timeout(60):
            while True:
                try:
                    await client.status()
                    break
                except LinkLost:
                    await asyncio.sleep(0.1)
    finally:
        await again.close()


async def _until(condition: Any) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.01)
