"""Voices for texts: robots use espeak-ng, if it is installed, and are silent without it.

People hum: syllables without words, the same on every machine.
"""

from __future__ import annotations

import io
import logging
import math
import shutil
import subprocess

import numpy as np

from roboglot.media.wav import read_wav
from roboglot.model.sound import SAMPLE_RATE, Sound

log = logging.getLogger(__name__)
PROGRAM = "espeak-ng"
SECONDS_MAX = 20.0  # of synthesis
LETTERS_PER_SECOND = 14.0
SYLLABLES_PER_SECOND = 4.5  # Chinese characters
SHORTEST = 0.4  # s
HIGHEST = 3000.0  # Hz in a hum
HUM = 0.2  # of full scale at a distance of one metre
CJK = ("\u3400", "\u9fff")


def speaking_time(text: str) -> float:
    """Return the time to say ``text``, s."""
    chinese = sum(CJK[0] <= letter <= CJK[1] for letter in text)
    return max(SHORTEST, chinese / SYLLABLES_PER_SECOND + (len(text) - chinese) / LETTERS_PER_SECOND)


def hummed(text: str, pitch: float) -> Sound:
    """Return a hum as long as ``text`` takes: a voice of ``pitch`` Hz that rises and falls with every syllable."""
    time = np.arange(round(speaking_time(text) * SAMPLE_RATE)) / SAMPLE_RATE
    tones = range(1, max(2, int(HIGHEST / pitch)))
    wave = sum((np.sin(math.tau * pitch * n * time) / n for n in tones), start=np.zeros(len(time)))
    wave *= np.abs(np.sin(math.pi * SYLLABLES_PER_SECOND * time)) * (HUM / np.abs(wave).max())
    return Sound(text, np.rint(wave * 32767).astype(np.int16))


def spoken(text: str) -> Sound | None:
    """Return ``text`` spoken by the installed program; None if it is missing or fails. Blocks meanwhile."""
    program = shutil.which(PROGRAM)
    if program is None:
        return None
    chinese = any(CJK[0] <= letter <= CJK[1] for letter in text)
    command = [program, "-v", "cmn" if chinese else "en", "--stdin", "--stdout"]
    try:
        done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=SECONDS_MAX, check=True)
        return read_wav(io.BytesIO(done.stdout), name="speech")
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        log.warning("%s cannot speak: %s", PROGRAM, error)
        return None
