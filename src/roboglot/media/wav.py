"""Reads WAV files (PCM, 8 to 32 bits, any rate and number of channels) as sounds of the model."""

from __future__ import annotations

import wave
from pathlib import Path
from typing import IO, TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.sound import SAMPLE_RATE, SECONDS_MAX, Sound

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")

RATES = range(1000, 384_001)
CHANNELS_MAX = 16
BYTES_MAX = 200_000_000


def read_wav(source: Path | IO[bytes], name: str = "") -> Sound:
    """Return a file's sound, mixed to mono, at 48 kHz. Raises ValueError in plain words, OSError."""
    name = name or (source.stem if isinstance(source, Path) else "sound")
    try:
        with wave.open(str(source) if isinstance(source, Path) else source, "rb") as file:
            channels, width, rate = file.getnchannels(), file.getsampwidth(), file.getframerate()
            if rate not in RATES or not 1 <= channels <= CHANNELS_MAX:
                raise ValueError(f"{name}: {rate} Hz with {channels} channels is not supported")
            frames = file.readframes(min(int(SECONDS_MAX * rate) + 1, BYTES_MAX // (channels * width)))
    except (wave.Error, EOFError, RuntimeError) as error:  # wave raises the last one for wrong chunk sizes
        raise ValueError(f"{name}: not a WAV file that can be read: {error or 'damaged'}") from None
    usable = len(frames) - len(frames) % (channels * width)
    mono = _numbers(frames[:usable], width).reshape(-1, channels).mean(axis=1)
    samples = np.clip(np.rint(_resampled(mono, rate) * 32767), -32768, 32767).astype(np.int16)
    samples.setflags(write=False)
    return Sound(name, samples)


def _numbers(frames: bytes, width: int) -> NDArray[np.float64]:
    """Return the samples as numbers in -1..1. Raises ValueError."""
    match width:
        case 1:
            return np.frombuffer(frames, dtype=np.uint8) / 127.5 - 1.0
        case 3:
            parts = np.frombuffer(frames, dtype=np.uint8).reshape(-1, 3).astype(np.int32)
            whole: NDArray[np.float64] = ((parts[:, 0] << 8 | parts[:, 1] << 16 | parts[:, 2] << 24) >> 8) / 8_388_608
            return whole
        case 2 | 4:
            return np.frombuffer(frames, dtype=f"<i{width}") / float(1 << (8 * width - 1))
        case _:
            raise ValueError(f"{8 * width} bits a sample are not supported")


def _resampled(wave_form: NDArray[np.float64], rate: int) -> NDArray[np.float64]:
    """Return the wave at SAMPLE_RATE, interpolated linearly; higher rates are averaged first, against aliasing."""
    if rate == SAMPLE_RATE or not len(wave_form):
        return wave_form
    if rate > SAMPLE_RATE:
        span = max(1, round(rate / SAMPLE_RATE))
        wave_form = np.convolve(wave_form, np.ones(span) / span, mode="same")
    count = len(wave_form) * SAMPLE_RATE // rate
    resampled: NDArray[np.float64] = np.interp(
        np.arange(count) * (rate / SAMPLE_RATE), np.arange(len(wave_form)), wave_form
    )
    return resampled
