"""The H.264 stream: decodes, also from the middle; one encoder for all; nothing while no one looks."""

from __future__ import annotations

import io
import re

import av
import numpy as np

from roboglot.media.h264 import BITRATE_MAX, H264Encoder
from roboglot.media.video import VideoStream
from tests.media.conftest import HEIGHT, WIDTH, number_of, picture
from tests.narrowing import of_kind


def decoded(data: bytes) -> list[int]:
    """Return the numbers of the pictures in an Annex B stream, as a player reads it."""
    with av.open(io.BytesIO(data), mode="r", format="h264") as file:
        return [number_of(of_kind(frame, av.VideoFrame).to_ndarray()[:HEIGHT]) for frame in file.decode(video=0)]


def units(data: bytes) -> list[int]:
    """Return the types of the NAL units."""
    return [data[match.end()] & 31 for match in re.finditer(b"\x00\x00\x01", data)]


def encoded(count: int, **keyframes: bool):
    encoder = H264Encoder(WIDTH, HEIGHT, 30.0)
    return [encoder.encode(picture(i % 38, i / 30), keyframe=keyframes.get(f"k{i}", False)) for i in range(count)]


def test_every_picture_is_out_at_once_and_decodes():
    packets = encoded(38)
    assert all(packet.data for packet in packets)
    assert decoded(b"".join(packet.data for packet in packets)) == list(range(38))


def test_packets_are_delimited_access_units_keyframes_carry_parameters():
    packets = encoded(65)
    assert [i for i, packet in enumerate(packets) if packet.keyframe] == [0, 30, 60]
    for packet in packets:
        kinds = [kind for kind in units(packet.data) if kind != 6]
        assert kinds == ([9, 7, 8, 5] if packet.keyframe else [9, 1])


def test_a_keyframe_comes_when_it_is_asked_for():
    packets = encoded(12, k7=True)
    assert [i for i, packet in enumerate(packets) if packet.keyframe] == [0, 7]
    assert decoded(b"".join(packet.data for packet in packets[7:])) == [7, 8, 9, 10, 11]


def test_the_same_pictures_give_the_same_bytes():
    assert [packet.data for packet in encoded(10)] == [packet.data for packet in encoded(10)]


def test_a_stream_that_is_too_large_becomes_coarser():
    """Noise is more than fits; the picture stays whole over the change, and is fine again once it is calm."""
    noise, encoder, packets = np.random.default_rng(3), H264Encoder(WIDTH, HEIGHT, 30.0), []
    for i in range(180):
        frame = picture(0, i / 30)
        if i < 120:
            frame.planes[:] = noise.integers(16, 236, frame.planes.shape)
        packets.append(encoder.encode(frame))
    sizes = [8 * sum(len(packet.data) for packet in packets[i : i + 30]) for i in range(0, 180, 30)]
    assert sizes[0] > BITRATE_MAX
    assert sizes[3] <= BITRATE_MAX
    with av.open(io.BytesIO(b"".join(packet.data for packet in packets)), format="h264") as file:
        seen = [of_kind(each, av.VideoFrame).to_ndarray()[:HEIGHT].astype(int) for each in file.decode(video=0)]
    assert len(seen) == 180
    assert np.abs(seen[-1] - frame.luma).mean() < 1.5


def test_colours_are_declared_and_survive():
    encoder = H264Encoder(WIDTH, HEIGHT, 30.0)
    frame = picture(0)
    frame.chroma[1][:] = 200
    with av.open(io.BytesIO(encoder.encode(frame).data), format="h264") as file:
        seen = next(file.decode(video=0))
    assert (seen.colorspace, seen.color_range) == (5, 1) or (int(seen.colorspace), int(seen.color_range)) == (6, 1)
    assert abs(seen.to_ndarray()[HEIGHT:].astype(int)[-10:].mean() - 200) < 3
    assert np.abs(seen.to_ndarray()[:HEIGHT].astype(int) - frame.luma).mean() < 4


async def test_viewers_share_one_encoder_and_join_in_middle(camera, lockstep):
    video = VideoStream(camera, lockstep)
    early, data, late_data = video.subscribe(), [], []
    await lockstep.advance(0.5)
    data += early.drain()
    late = video.subscribe()
    await lockstep.advance(0.5)
    new = early.drain()
    data += new
    late_data = late.drain()
    assert late_data[0].keyframe
    assert all(any(packet is other for other in new) for packet in late_data)
    assert camera.taken == len(data) == 30
    assert decoded(b"".join(packet.data for packet in data)) == list(range(30))
    assert decoded(b"".join(packet.data for packet in late_data)) == list(range(30 - len(late_data), 30))
    assert len(late_data) >= 14
    early.close()
    late.close()
    await lockstep.advance(1.0)
    assert camera.taken == 30


async def test_a_slow_viewer_goes_on_at_a_keyframe(camera, lockstep):
    video = VideoStream(camera, lockstep)
    with video.subscribe() as slow:
        await lockstep.advance(2.5)
        packets = slow.drain()
        assert packets[0].keyframe
        assert slow.dropped > 0
        numbers = decoded(b"".join(packet.data for packet in packets))
        assert numbers == [(75 - len(packets) + i) % 38 for i in range(len(packets))]


async def test_the_stream_ends_with_the_camera(camera, lockstep):
    video = VideoStream(camera, lockstep)
    viewer = video.subscribe()
    await lockstep.advance(0.2)
    camera.feed.close()
    await lockstep.advance(0.1)
    assert viewer.closed
    assert len([packet async for packet in viewer]) == 6
