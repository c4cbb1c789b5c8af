"""Live video and sound of the console: what is heard, who may see it, for how long."""

from __future__ import annotations

import asyncio
import io
import wave as wave_module
from types import SimpleNamespace
from typing import Any
from urllib.request import urlopen

import av
import numpy as np
import pytest
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

from roboglot.console.camera import Calls
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.sound import SAMPLE_RATE, Sound
from roboglot.wire.ice import offer_loopback
from tests.console.conftest import ServedConsole
from tests.narrowing import of_kind

PITCH = 1000  # Hz


async def call(served: ServedConsole, *kinds: str) -> RTCPeerConnection:
    """Return a page's end of a call for media of ``kinds``."""
    offer_loopback()
    peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    for kind in kinds:
        peer.addTransceiver(kind, direction="recvonly")
    await peer.setLocalDescription(await peer.createOffer())
    status, words = await served.ask("/api/robots/a/camera/call", {"offer": peer.localDescription.sdp})
    assert status == 200, words
    await peer.setRemoteDescription(RTCSessionDescription(words["answer"], "answer"))
    return peer


def pitch_of(samples: Any) -> float:
    """Hz of the loudest part; 0 for silence."""
    spectrum = np.abs(np.fft.rfft(samples))
    return 0.0 if samples.max() < 100 else float(np.fft.rfftfreq(len(samples), 1 / SAMPLE_RATE)[spectrum.argmax()])


async def test_a_page_hears_what_the_robot_hears(served: ServedConsole) -> None:
    peer = await call(served, "video", "audio")
    (receiver,) = (each for each in peer.getReceivers() if each.track.kind == "audio")
    wave = 8000 * np.sin(2 * np.pi * PITCH / SAMPLE_RATE * np.arange(60 * SAMPLE_RATE))
    served.robot[Speaker].play(Sound("tone", wave.astype(np.int16)))

    async def pass_time() -> None:
        while True:
            await served.clock.advance(0.02)
            await asyncio.sleep(0.005)

    passing, heard = asyncio.ensure_future(pass_time()), 0.0
    try:
        async with asyncio.timeout(60):
            while abs(heard - PITCH) > PITCH / 20:
                frame = await receiver.track.recv()
                heard = pitch_of(of_kind(frame, av.AudioFrame).to_ndarray().reshape(-1, 2)[:, 0].astype(float))
    finally:
        passing.cancel()
        await peer.close()


async def test_sound_comes_as_an_endless_wav_file(served: ServedConsole) -> None:
    wave = 8000 * np.sin(2 * np.pi * PITCH / SAMPLE_RATE * np.arange(60 * SAMPLE_RATE))
    served.robot[Speaker].play(Sound("tone", wave.astype(np.int16)))
    playing = await asyncio.to_thread(urlopen, f"{served.url}/api/robots/a/sound.wav")
    file = bytearray()
    while len(file) < 44 + SAMPLE_RATE:
        await served.clock.advance(0.02)
        file += await asyncio.to_thread(playing.read1)
    playing.close()
    with wave_module.open(io.BytesIO(file)) as sound:
        assert (sound.getframerate(), sound.getnchannels(), sound.getsampwidth()) == (SAMPLE_RATE, 1, 2)
    samples = np.frombuffer(file[44 : 44 + SAMPLE_RATE], np.int16).astype(float)
    assert pitch_of(samples) == pytest.approx(PITCH, rel=0.05)


async def test_page_asking_for_pictures_only_gets_no_sound(served: ServedConsole) -> None:
    peer = await call(served, "video")
    assert "m=audio" not in peer.remoteDescription.sdp
    await peer.close()


async def test_call_ends_when_its_caller_loses_the_right(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.console.camera.REVOKED_SECONDS", 0.0)
    answers, closed = iter([True, True, False]), asyncio.Event()

    class Call:
        async def close(self) -> None:
            closed.set()

    robot: Any = SimpleNamespace(admission=SimpleNamespace(may=lambda _right: next(answers)))
    call: Any = Call()
    calls = Calls()
    calls._calls.add(call)
    calls._look_after(robot, call)
    assert not closed.is_set()
    async with asyncio.timeout(60):
        await closed.wait()
    assert not calls._calls
