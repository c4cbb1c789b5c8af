"""Opus packets of 20 ms: 48 kHz, mono."""

from __future__ import annotations

from fractions import Fraction

from roboglot.model.components.sensing.microphone import BLOCK
from roboglot.model.sound import SAMPLE_RATE, SoundBlock
from roboglot.values import dataclass

BITRATE = 32_000  # bit/s


@dataclass(frozen=True, slots=True)
class AudioPacket:
    """One encoded block of sound; ``stamp``: robot time of its first sample, s."""

    stamp: float
    data: bytes


class OpusEncoder:
    """libopus with low delay; ``vbr`` off gives every packet the same size. One call at a time, from any thread."""

    def __init__(self, *, bitrate: int = BITRATE, vbr: bool = True) -> None:
        import av

        if not 6_000 <= bitrate <= 256_000:
            raise ValueError(f"Opus speech takes 6000 to 256000 bit/s, not {bitrate}")
        self._codec = av.AudioCodecContext.create("libopus", "w")
        self._codec.sample_rate, self._codec.layout, self._codec.format = SAMPLE_RATE, "mono", "s16"
        self._codec.bit_rate, self._codec.time_base = bitrate, Fraction(1, SAMPLE_RATE)
        self._codec.options = {"application": "lowdelay", "frame_duration": "20", "vbr": "on" if vbr else "off"}
        self._position = 0

    def encode(self, block: SoundBlock) -> AudioPacket:
        """Return the packet of a block of BLOCK samples. Raises ValueError for another length."""
        from av import AudioFrame

        if len(block.samples) != BLOCK:
            raise ValueError(f"a block has {BLOCK} samples, not {len(block.samples)}")
        frame = AudioFrame.from_ndarray(block.samples.reshape(1, -1), format="s16", layout="mono")
        frame.sample_rate, frame.time_base, frame.pts = SAMPLE_RATE, Fraction(1, SAMPLE_RATE), self._position
        self._position += BLOCK
        return AudioPacket(block.stamp, b"".join(map(bytes, self._codec.encode(frame))))
