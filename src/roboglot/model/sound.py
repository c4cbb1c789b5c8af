"""Sounds as samples: 48 kHz, mono, 16 bits. Knows no file and no loudspeaker."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from roboglot.extras import lazy
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


SAMPLE_RATE = 48_000
SECONDS_MAX = 300.0
Samples: TypeAlias = "NDArray[np.int16]"


@dataclass(frozen=True, slots=True)
class Sound:
    """``samples``: what a microphone a metre away takes down, int16 at SAMPLE_RATE. Raises ValueError if too long."""

    name: str
    samples: Samples

    def __post_init__(self) -> None:
        if self.seconds > SECONDS_MAX:
            raise ValueError(f"{self.name} takes {self.seconds:.0f} s, more than {SECONDS_MAX:.0f}")

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return len(self.samples) / SAMPLE_RATE


@dataclass(frozen=True, slots=True)
class SoundBlock:
    """A piece of what a microphone hears: int16 samples at SAMPLE_RATE; ``stamp``: robot time of the first one, s."""

    stamp: float
    samples: Samples


def tone(frequency: float, seconds: float, loudness: float = 0.3) -> Sound:
    """Return a sine of ``frequency`` Hz with soft ends; ``loudness`` 0..1 of full scale."""
    if not 20.0 <= frequency <= 20_000.0 or not 0.0 < seconds <= SECONDS_MAX or not 0.0 <= loudness <= 1.0:
        raise ValueError("a tone has 20 to 20000 Hz, takes up to 300 s and is 0 to 1 loud")
    time = np.arange(round(seconds * SAMPLE_RATE)) / SAMPLE_RATE
    ends = np.minimum(1.0, np.minimum(time, seconds - time) / 0.005)
    return Sound(f"tone {frequency:g} Hz", _sampled(loudness * ends * np.sin(2 * np.pi * frequency * time)))


def claps(count: int = 2, pause: float = 0.35, loudness: float = 0.8) -> Sound:
    """Hands clapping ``count`` times, ``pause`` s apart: bursts of noise that die away in 20 ms."""
    if not 1 <= count <= 50 or not 0.05 <= pause <= 5.0 or not 0.0 <= loudness <= 1.0:
        raise ValueError("1 to 50 claps, 0.05 to 5 s apart, 0 to 1 loud")
    time = np.arange(round(0.12 * SAMPLE_RATE)) / SAMPLE_RATE
    burst = np.random.Generator(np.random.PCG64(7)).standard_normal(len(time)) * np.exp(-time / 0.02)
    burst *= loudness / np.abs(burst).max()
    whole = np.zeros(round((count - 1) * pause * SAMPLE_RATE) + len(burst))
    for number in range(count):
        begin = round(number * pause * SAMPLE_RATE)
        whole[begin : begin + len(burst)] += burst
    return Sound(f"{count} claps", _sampled(whole))


def _sampled(wave: NDArray[np.float64]) -> Samples:
    samples = np.clip(np.rint(wave * 32767), -32768, 32767).astype(np.int16)
    samples.setflags(write=False)
    return samples
