"""Topics of viewers: schemas that describe them, data as in recordings, the last state for newcomers."""

from __future__ import annotations

import base64
import json
from typing import Any

import httpx
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.exceptions import InvalidStatus

from roboglot.media.video import VideoStream
from roboglot.protocols.foxglove import context as door_context
from roboglot.protocols.foxglove import server
from tests.protocols.foxglove.conftest import ADDRESS, Opened, Scene, Viewer


def decoded(channel: dict[str, Any], data: bytes) -> Any:
    """Decode by the schema alone that the channel came with, as a viewer does."""
    if channel["encoding"] == "json":
        assert channel["schemaEncoding"] == "jsonschema"
        assert json.loads(channel["schema"])["title"] == channel["schemaName"]
        return json.loads(data)
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"])).file:
        pool.Add(file)
    found = message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))()
    found.ParseFromString(data)
    return found


async def last(viewer: Viewer, topic: str, seconds: float = 3.0) -> Any:
    """Return the next message of a topic, decoded."""
    await viewer.topic(topic, seconds)
    number = await viewer.subscribe(topic)
    await viewer.until(lambda: viewer.data.get(number), seconds)
    return decoded(viewer.channels[topic], viewer.data[number][-1][1])


async def test_video_is_advertised_once_it_is_there(scene: Scene) -> None:
    """A real robot's video is known once it is connected."""
    video = scene.robot[VideoStream]
    scene.robot.withdraw(VideoStream)
    viewer = await scene.connect()
    await viewer.topic("/a/pose", 1.0)
    assert "/a/camera" not in viewer.channels
    scene.robot.add(VideoStream, video)
    assert (await viewer.topic("/a/camera", 2.0))["schemaName"] == "foxglove.CompressedVideo"


@pytest.mark.parametrize("name", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
async def test_both_generations_of_viewers_are_served(scene: Scene, name: str) -> None:
    viewer = await scene.connect("something.else", name)
    assert viewer.socket.subprotocol == name
    await viewer.until(lambda: "serverInfo" in viewer.said)
    (info,) = viewer.said["serverInfo"]
    assert info["supportedEncodings"] == ["json"]
    assert {"clientPublish", "parameters", "parametersSubscribe", "time"} == set(info["capabilities"])
    assert info["metadata"]["robot"] == "a"


async def test_another_protocol_is_refused(scene: Scene) -> None:
    with pytest.raises(InvalidStatus) as refused:
        await scene.connect("rosbridge")
    assert refused.value.response.status_code == 400


async def test_topics_are_those_of_recordings_described_by_schemas(scene: Scene) -> None:
    await scene.clock.advance(3.0)
    viewer = await scene.connect()
    scan = await last(viewer, "/a/scan")
    assert scan.frame_id == "a/laser"
    assert len(scan.ranges) > 100
    pose = await last(viewer, "/a/pose")
    assert pose.frame_id == "a/map"
    assert abs(pose.pose.position.x) < 0.05
    battery = await last(viewer, "/a/battery")
    assert 0.0 < battery["percentage"] <= 1.0
    air = await last(viewer, "/a/pressure")
    assert 80_000 < air["pressure"] < 110_000
    body = await last(viewer, "/a/body")
    assert body.entities[0].cylinders[0].size.x == pytest.approx(2 * scene.robot.description.radius)
    grid = await last(viewer, "/a/map", 6.0)
    assert isinstance(grid.SerializeToString(), bytes)
    assert Grid.FromString(grid.SerializeToString()).column_count > 10


async def test_frames_make_one_tree_at_time_of_robot(scene: Scene) -> None:
    viewer = await scene.connect()
    number = await viewer.subscribe("/tf")
    await viewer.until(lambda: len(viewer.data.get(number, ())) > 3, 2.0)
    at, data = viewer.data[number][-1]
    frames = FrameTransforms.FromString(data).transforms
    pairs = [(frame.parent_frame_id, frame.child_frame_id) for frame in frames]
    assert pairs == [("a/map", "a/odom"), ("a/odom", "a/base_link"), ("a/base_link", "a/laser")]
    assert all(frame.timestamp.seconds * 10**9 + frame.timestamp.nanos == at for frame in frames)
    await viewer.until(lambda: viewer.times and viewer.times[-1] >= at)
    assert viewer.times == sorted(viewer.times)


async def test_a_newcomer_gets_the_state_at_once(scene: Scene) -> None:
    first = await scene.connect()
    await first.topic("/a/battery")
    viewer = await scene.connect()
    number = await viewer.subscribe("/a/battery")
    await viewer.until(lambda: viewer.data.get(number))  # no robot time passes


async def test_requests_at_doors_are_topics_without_secrets(scene: Scene) -> None:
    viewer = await scene.connect()
    await viewer.topic("/a/pose")
    async with httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", verify=False) as client:
        await client.get("/api/core/system/v1/power/status")
        number = await viewer.subscribe("/a/slamware")
        await viewer.settled()
        await client.post("/api/core/motion/v1/actions", json={"action_name": "fly", "wifi_password": "geheim"})
    await viewer.until(lambda: len(viewer.data.get(number, ())) >= 2)
    request, reply = (json.loads(data) for _, data in viewer.data[number][:2])
    assert request["operation"] == "POST /api/core/motion/v1/actions"
    assert reply["status"] == "400"
    assert b"geheim" not in b"".join(data for _, data in viewer.data[number])


async def test_unsubscribing_ends_it(scene: Scene) -> None:
    viewer = await scene.connect()
    number = await viewer.subscribe("/a/pose")
    await viewer.until(lambda: viewer.data.get(number), 1.0)
    await viewer.say("unsubscribe", subscriptionIds=[number])
    await viewer.settled()
    count, times = len(viewer.data[number]), len(viewer.times)
    await scene.clock.advance(1.0)
    await viewer.until(lambda: len(viewer.times) > times + 5)
    assert len(viewer.data[number]) == count
    assert viewer.complaints == []


async def test_nothing_is_looked_at_while_no_one_looks(scene: Scene) -> None:
    assert not scene.robot.tap.watched
    viewer = await scene.connect()
    await viewer.topic("/a/pose")
    assert scene.robot.tap.watched
    await viewer.close()
    await viewer.until(lambda: not scene.robot.tap.watched)


async def test_wrong_messages_are_answered_in_words(scene: Scene) -> None:
    viewer = await scene.connect()
    await viewer.topic("/a/pose")
    wrong: tuple[str | bytes, ...] = (
        "[]",
        "{",
        b"",
        b"\x09abc",
        b"\x01\x00",
        '{"op": "subscribe"}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 9999}]}',
        '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}',
        '{"op": "unsubscribe", "subscriptionIds": [77]}',
        '{"op": "serviceCallRequest"}',
        '{"op": "serviceCallRequest", "service": "x", "call": []}',
        '{"op": "unsubscribe", "subscriptionIds": [null]}',
        '{"op": "subscribeConnectionGraph"}',
        b"\x03" + bytes(17),
    )
    for message in wrong:
        await viewer.socket.send(message)
    await viewer.until(lambda: len(viewer.complaints) == len(wrong))
    assert [row["level"] for row in viewer.said["status"]] == [2] * len(wrong)
    assert "unsubscribe: subscriptionIds[0] must be a whole number, not null" in viewer.complaints
    await viewer.socket.send(b"\x02" + (7).to_bytes(4, "little") + (8).to_bytes(4, "little") + bytes(4))
    await viewer.until(lambda: "serviceCallFailure" in viewer.said)
    assert (viewer.said["serviceCallFailure"][0]["serviceId"], viewer.said["serviceCallFailure"][0]["callId"]) == (7, 8)
    await viewer.say("fetchAsset", uri="package://a.urdf", requestId=5)
    await viewer.until(lambda: viewer.binary)
    assert viewer.binary[0][:6] == b"\x04\x05\x00\x00\x00\x01"


async def test_slow_reader_misses_messages_and_is_notified(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    viewer = await scene.connect()
    number = await viewer.subscribe("/a/pose")
    await viewer.until(lambda: viewer.data.get(number), 1.0)
    monkeypatch.setattr(door_context, "UNSENT_MAX", -1)
    await scene.clock.advance(2.5)
    monkeypatch.undo()
    await viewer.until(lambda: any("were dropped" in words for words in viewer.complaints), 12.0)


async def test_so_many_viewers_and_no_more(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "CLIENTS_MAX", 1)
    first = await scene.connect()
    await first.topic("/a/pose")
    second = await scene.connect()
    await second.socket.wait_closed()
    assert second.socket.close_code == 1013


async def test_it_can_be_switched_off(opened: Opened) -> None:
    scene = await opened(foxglove={"enabled": False})
    with pytest.raises(OSError, match=r"refused|Connect"):
        await scene.connect()
