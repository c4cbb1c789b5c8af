"""Chapter "image transmission": offers answered by pushes, pictures that move, several apps, stops, failures."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription
from aiortc.sdp import candidate_from_sdp

from roboglot.media import webrtc
from roboglot.media.video import VideoStream
from roboglot.protocols.cyberdog.chapters.camera import transmission as door_video
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.wire.ice import offer_loopback
from tests.drivers.settling import settle
from tests.protocols.cyberdog.phone import PATIENCE, App, Client, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")


class Watcher:
    """An app's end of one connection."""

    def __init__(self, client: Client, app: App, uid: str = "phone") -> None:
        offer_loopback()  # apps have an address
        self.peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self.peer.addTransceiver("video", direction="recvonly")
        self.client, self.app, self.uid = client, app, uid
        self.frames: list[Any] = []
        self._reading: asyncio.Future[None] | None = None
        self.peer.add_listener("track", self._see)

    def _see(self, track: Any) -> None:
        self._reading = asyncio.ensure_future(self._read(track))

    async def _read(self, track: Any) -> None:
        while True:
            self.frames.append(await track.recv())

    def signals(self, key: str) -> list[Any]:
        return [push for push in self.app.of(4001) if push["uid"] == self.uid and key in push]

    async def offer(self, **more: object) -> None:
        await self.peer.setLocalDescription(await self.peer.createOffer())
        sdp = {"type": "offer", "sdp": self.peer.localDescription.sdp}
        assert await self.client.ask(4001, {"offer_sdp": sdp, "uid": self.uid, **more}) == ""

    async def connect(self, **more: object) -> None:
        before, failed = len(self.signals("answer_sdp")), len(self.signals("error"))
        await self.offer(**more)
        await until(lambda: len(self.signals("answer_sdp")) > before or len(self.signals("error")) > failed)
        assert len(self.signals("answer_sdp")) > before, self.signals("error")
        answer = self.signals("answer_sdp")[-1]["answer_sdp"]
        await self.peer.setRemoteDescription(RTCSessionDescription(answer["sdp"], answer["type"]))
        await until(lambda: self.peer.connectionState == "connected")

    async def close(self) -> None:
        if self._reading:
            self._reading.cancel()
        await self.peer.close()


@pytest.fixture
async def watch(client, app, door, passing, monkeypatch) -> AsyncIterator[Callable[..., Any]]:
    monkeypatch.setattr(door_video, "PATIENCE", 2 * PATIENCE)  # of the machine's time: a busy one takes its own
    await client.ask(10001)
    await passing(lambda: door._context.app.connected)
    watchers: list[Watcher] = []

    def begin(uid: str = "phone") -> Watcher:
        watchers.append(Watcher(client, app, uid))
        return watchers[-1]

    yield begin
    for watcher in watchers:
        await watcher.close()


@asynccontextmanager
async def time_passing(forward) -> AsyncIterator[None]:
    """Robot time passes beside the network's."""

    async def run() -> None:
        while True:
            await forward(seconds=1 / 30)
            await asyncio.sleep(0.01)

    task = asyncio.ensure_future(run())
    yield
    task.cancel()


async def test_an_app_sees_pictures_of_the_camera(watch, door: CyberDogDoor, robot, world, forward) -> None:
    watcher = watch()
    await watcher.connect()
    assert "H264" in watcher.signals("answer_sdp")[0]["answer_sdp"]["sdp"]
    assert "VP8" not in watcher.signals("answer_sdp")[0]["answer_sdp"]["sdp"]
    async with time_passing(forward):
        await until(lambda: len(watcher.frames) >= 10, 4 * PATIENCE)
    assert (watcher.frames[0].width, watcher.frames[0].height) == (1280, 720)
    seen = watcher.frames[-1].to_ndarray(format="gray")
    real = (await robot[door_video.Camera].capture()).luma
    assert abs(seen.astype(float) - real.astype(float)).mean() < 12
    assert all(a.pts < b.pts for a, b in zip(watcher.frames, watcher.frames[1:], strict=False))
    candidate = watcher.signals("c_sdp")[0]["c_sdp"]
    assert candidate["sdpMLineIndex"] == 0
    assert candidate_from_sdp(candidate["candidate"].removeprefix("candidate:")).component == 1


async def test_two_apps_share_one_encoder_and_one_stops(watch, client, app, robot, forward) -> None:
    one, two = watch("one"), watch("two")
    await one.connect()
    await two.connect()
    async with time_passing(forward):
        await until(lambda: min(len(one.frames), len(two.frames)) >= 3, 4 * PATIENCE)
        assert robot[VideoStream]._feed.viewers == 2
        assert await client.ask(4001, {"uid": "one"}) == ""
        await until(lambda: one.signals("is_closed"))
        assert one.signals("is_closed") == [{"is_closed": True, "uid": "one"}]
        await until(lambda: robot[VideoStream]._feed.viewers == 1)
        before = len(two.frames)
        await until(lambda: len(two.frames) >= before + 3, 4 * PATIENCE)
    assert not two.signals("is_closed")


async def test_lost_pictures_are_answered_by_the_next_keyframe(watch, robot, forward, monkeypatch) -> None:
    watcher = watch()
    await watcher.connect()
    asked: list[float] = []
    real = robot[VideoStream].request_keyframe

    def ask() -> None:
        asked.append(1.0)
        real()

    monkeypatch.setattr(robot[VideoStream], "request_keyframe", ask)
    async with time_passing(forward):
        await until(lambda: len(watcher.frames) >= 3, 4 * PATIENCE)
        asked.clear()
        (receiver,) = watcher.peer.getReceivers()
        (source,) = [s.source for s in receiver.getSynchronizationSources()]
        for _ in range(20):
            await receiver._send_rtcp_pli(source)
        await until(lambda: asked)
    assert len(asked) == 1  # twenty at once yield one picture


async def test_phone_held_upright_gets_picture_of_its_shape(watch, forward) -> None:
    watcher = watch()
    await watcher.connect(height=1280, width=720, alignment="top")
    async with time_passing(forward):
        await until(lambda: watcher.frames, 4 * PATIENCE)
    frame = watcher.frames[-1]
    assert (frame.width, frame.height) == (640, 1138)
    luma = frame.to_ndarray(format="yuv420p")[:1138]
    assert luma[:350].std() > 5
    assert luma[370:].mean() == pytest.approx(16, abs=1)  # the lower part is black


async def test_without_way_to_the_app_it_gives_up(watch, monkeypatch) -> None:
    monkeypatch.setattr(door_video, "PATIENCE", 0.2)
    watcher = watch()
    await watcher.offer()  # without ever reading the answer
    await until(lambda: watcher.signals("error"))
    assert watcher.signals("error")[0]["error"]["code"] == 1002
    assert await watcher.client.ask(4001, {"uid": "phone"}) == ""
    await settle()
    assert not watcher.signals("is_closed")  # that name is gone


async def test_invalid_offers_are_reported(watch, client, app) -> None:
    for sdp in ("v=0", {"type": "offer", "sdp": "nonsense\r\nm=video"}, {"type": "offer", "sdp": "m=" * 99}):
        assert await client.ask(4001, {"offer_sdp": sdp, "uid": "bad"}) == ""
        await until(lambda: app.of(4001))
        assert app.of(4001)[-1]["error"]["code"] == 1002
        app.pushed.clear()
    for nonsense in (
        {},
        {"uid": 7},
        {"uid": "x" * 1000},
        {"offer_sdp": 5},
        {"offer_sdp": {"sdp": 9}},
        {"offer_sdp": ""},
        {"c_sdp": {"candidate": "candidate:garbage", "sdpMid": "0", "sdpMLineIndex": 0}},
        {"answer_sdp": {"type": "answer", "sdp": "v=0"}},
        {"c_sdp": []},
    ):
        assert await client.ask(4001, nonsense) == ""
    await settle()
    assert app.of(4001) == []


async def test_offer_as_text_with_line_ends_in_it(watch) -> None:
    watcher = watch("default_uid")
    await watcher.peer.setLocalDescription(await watcher.peer.createOffer())
    raw = '{"offer_sdp": "' + watcher.peer.localDescription.sdp.replace('"', "") + '"}'
    with pytest.raises(json.JSONDecodeError):
        json.loads(raw)
    ((_, data),) = await watcher.client.raw(4001, raw)
    assert data == ""
    await until(lambda: watcher.signals("answer_sdp"))


async def test_candidates_that_come_before_the_offer_are_kept(watch, client, door) -> None:
    watcher = watch()
    await watcher.peer.setLocalDescription(await watcher.peer.createOffer())
    lines = watcher.peer.localDescription.sdp.splitlines()
    ours = [line for line in lines if line.startswith("a=candidate")]
    bare = "\r\n".join(line for line in lines if not line.startswith(("a=candidate", "a=end-of"))) + "\r\n"
    for line in ours:
        c_sdp = {"sdpMid": "0", "sdpMLineIndex": 0, "candidate": line[2:]}
        await client.ask(4001, {"c_sdp": c_sdp, "uid": "phone"})
    await client.ask(4001, {"offer_sdp": {"type": "offer", "sdp": bare}, "uid": "phone"})
    await until(lambda: watcher.signals("answer_sdp"))
    answer = watcher.signals("answer_sdp")[0]["answer_sdp"]
    await watcher.peer.setRemoteDescription(RTCSessionDescription(answer["sdp"], "answer"))
    await until(lambda: watcher.peer.connectionState == "connected")


async def test_answer_of_a_robot_with_many_addresses_comes(watch, monkeypatch) -> None:
    real = webrtc.VideoCall.candidates
    monkeypatch.setattr(webrtc.VideoCall, "candidates", lambda call: [*real(call)][:1] * 40)
    await watch().connect()


async def test_answers_to_all_apps_at_once_arrive(watch, client, app, door) -> None:
    await client.ask(10001)
    await until(lambda: app.connected)
    uids = [str(number) for number in range(door_video.PEERS_MAX)]
    for uid in uids:
        door._context.video._push(door_video.Description(uid, "answer", "v=0"))
        for number in range(door_video.PUSHED_MAX):
            door._context.video._push(door_video.Candidate(uid, f"candidate:{number}", "0", 0))
    await until(lambda: len(app.of(4001)) == len(uids) * (1 + door_video.PUSHED_MAX))
    assert [push["uid"] for push in app.of(4001) if "answer_sdp" in push] == uids


async def test_more_apps_than_there_is_room_for(watch, client, door, monkeypatch) -> None:
    monkeypatch.setattr(door_video, "PEERS_MAX", 2)
    watchers = [watch(str(number)) for number in range(3)]
    for watcher in watchers:
        await watcher.offer()
    await until(lambda: watchers[0].signals("answer_sdp") and watchers[1].signals("answer_sdp"))
    assert door._context.video.viewers == 2
    await until(lambda: watchers[2].signals("error"))
    assert watchers[2].signals("error")[0]["error"]["code"] == 1002
    assert not watchers[2].signals("answer_sdp")


async def test_new_offer_of_an_app_replaces_its_call(watch, client, door, robot, forward) -> None:
    gone, back = watch(), watch()
    await gone.connect()
    async with time_passing(forward):
        await until(lambda: gone.frames, 4 * PATIENCE)
        await back.connect()
        await until(lambda: back.frames, 4 * PATIENCE)
        await until(lambda: robot[VideoStream]._feed.viewers == 1)
    assert not back.signals("is_closed")
    assert door._context.video.viewers == 1


async def test_a_robot_without_a_camera(client: Client, robot) -> None:
    del robot._components[door_video.Camera]
    assert await client.ask(4001, {"uid": "phone"}) == {"error_code": 322}
