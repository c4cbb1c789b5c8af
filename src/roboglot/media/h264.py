"""H.264 for live viewers: Annex B, parameter sets before every keyframe, no delayed pictures."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from roboglot.model.components.sensing.camera import Frame
from roboglot.values import dataclass

if TYPE_CHECKING:
    from av import VideoCodecContext

TIME_BASE = Fraction(1, 90_000)
RATE_FACTOR = 24  # x264's crf: fine enough to read markers
BITRATE_MAX = 8_000  # kbit/s


@dataclass(frozen=True, slots=True)
class VideoPacket:
    """One encoded picture: an access unit with its delimiter. Viewers join at a ``keyframe``. ``stamp``: s."""

    stamp: float
    data: bytes
    keyframe: bool


class H264Encoder:
    """x264, ultrafast, one thread; the same pictures give the same bytes. One call at a time, from any thread."""

    def __init__(self, width: int, height: int, rate: float) -> None:
        self._codec = _open(width, height, rate)

    def encode(self, frame: Frame, *, keyframe: bool = False) -> VideoPacket:
        """Return the packet of ``frame``; ``keyframe``: force one to join at (there is one per second anyway)."""
        from av import VideoFrame
        from av.video.frame import PictureType

        picture = VideoFrame.from_numpy_buffer(frame.planes, format="yuv420p")
        picture.pts, picture.time_base = round(frame.stamp / TIME_BASE), TIME_BASE
        if keyframe:
            picture.pict_type = PictureType.I
        packets = self._codec.encode(picture)
        return VideoPacket(frame.stamp, b"".join(map(bytes, packets)), any(packet.is_keyframe for packet in packets))


def _open(width: int, height: int, rate: float) -> VideoCodecContext:
    import av  # a quarter of a second

    codec = av.VideoCodecContext.create("libx264", "w")
    codec.width, codec.height, codec.pix_fmt = width, height, "yuv420p"
    codec.time_base, codec.framerate = TIME_BASE, Fraction(rate).limit_denominator(1000)
    codec.thread_count = 1
    # BT.601 in limited range, stated explicitly: players guess otherwise at this size.
    codec.color_range, codec.colorspace, codec.color_primaries, codec.color_trc = 1, 6, 6, 6
    second = max(1, round(rate))
    x264 = {
        "aud": 1, "repeat-headers": 1, "annexb": 1, "force-cfr": 1, "keyint": second, "min-keyint": 1, "scenecut": 0,
        "vbv-maxrate": BITRATE_MAX, "vbv-bufsize": BITRATE_MAX // 2, "threads": 1, "sliced-threads": 0,
    }  # fmt: skip
    codec.gop_size = second
    codec.options = {
        "preset": "ultrafast",
        "tune": "zerolatency",
        "crf": str(RATE_FACTOR),
        "forced-idr": "1",
        "x264-params": ":".join(f"{name}={value}" for name, value in x264.items()),
    }
    return codec
