"""Two short pieces of music of our own, played on strings that numpy plucks. Knows no file and no loudspeaker."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.sound import SAMPLE_RATE, Sound

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")

_A4 = 440.0  # Hz
_STEPS = {"c": -9, "d": -7, "e": -5, "f": -4, "g": -2, "a": 0, "b": 2}  # semitones from a
_LOUDEST = 20_000.0  # of a sample
_RING = 0.35  # s in which a string fades to a third
_PARTIALS = (1.0, 0.5, 0.25, 0.12)  # of a string, by their loudness

# A voice is a list of notes separated by blanks: name, sharp (+), octave, and beats after a colon; "-" is a rest.
_ROMP = (
    "g4:1 c5:1 e5:1 c5:1 d5:1 f5:1 e5:2 g5:1 e5:1 c5:1 e5:1 d5:1 b4:1 c5:2"
    " a4:1 c5:1 f5:1 a5:1 g5:1 e5:1 c5:2 d5:1 e5:1 f5:1 b4:1 c5:3 -:1",
    "c3:2 g3:2 b3:2 c4:2 c3:2 g3:2 g3:2 c3:2 f3:2 f3:2 c3:2 e3:2 g3:2 g3:2 c3:4",
)
_WALTZ = (
    "e5:2 d5:1 c5:2 a4:1 b4:1 c5:1 d5:1 e5:3 f5:2 e5:1 d5:2 b4:1 g+4:1 a4:1 b4:1 a4:3",
    "a2:1 e3:1 c4:1 a2:1 e3:1 c4:1 g2:1 d3:1 b3:1 c3:1 g3:1 e4:1 d3:1 a3:1 f4:1 e3:1 b3:1 d4:1 e3:1 b3:1 d4:1 a2:3",
)


@cache
def romp() -> Sound:
    """Return eight lively bars in C, 6.4 s long."""
    return _played("romp", _ROMP, 0.2)


@cache
def evening_waltz() -> Sound:
    """Return eight bars of a slow waltz in A minor, 9.6 s long."""
    return _played("evening waltz", _WALTZ, 0.4)


def _played(name: str, voices: tuple[str, ...], beat: float) -> Sound:
    """Return the mix of all voices, at ``beat`` s per beat."""
    parts = [_sung(voice, beat) for voice in voices]
    whole = np.zeros(max(map(len, parts)))
    for part in parts:
        whole[: len(part)] += part
    return Sound(name, np.rint(whole / np.abs(whole).max() * _LOUDEST).astype(np.int16))


def _sung(voice: str, beat: float) -> NDArray[np.float64]:
    notes = []
    for note in voice.split():
        pitch, _, beats = note.partition(":")
        samples = round(float(beats) * beat * SAMPLE_RATE)
        notes.append(np.zeros(samples) if pitch == "-" else _plucked(_frequency(pitch), samples))
    return np.concatenate(notes)


def _frequency(pitch: str) -> float:
    """Return the frequency (Hz) of a note such as ``c4`` or ``g+4``, in equal temperament."""
    steps = _STEPS[pitch[0]] + pitch.count("+") + 12 * (int(pitch[-1]) - 4)
    return float(_A4 * 2.0 ** (steps / 12))


def _plucked(frequency: float, samples: int) -> NDArray[np.float64]:
    """Return a plucked string: loud at once, fading, higher partials faster; damped at the end to avoid a click."""
    time = np.arange(samples) / SAMPLE_RATE
    fading = np.exp(-time / _RING)
    whole, sound = np.zeros(samples), fading.copy()
    for number, loudness in enumerate(_PARTIALS, 1):
        whole += loudness * sound * np.sin(2 * np.pi * frequency * number * time)
        sound *= fading
    whole *= np.minimum(1.0, np.minimum(time / 0.003, (time[-1] - time) / 0.01))
    return whole
