"""A voice for texts: espeak-ng if that program is installed. Without it there is none, and nobody pretends."""

from __future__ import annotations

import io
import logging
import shutil
import subprocess

from roboglot.media.wav import read_wav
from roboglot.model.sound import Sound

log = logging.getLogger(__name__)
PROGRAM = "espeak-ng"
SECONDS_MAX = 20.0  # of computing
LETTERS_PER_SECOND = 14.0
SYLLABLES_PER_SECOND = 4.5  # Chinese characters
SHORTEST = 0.4  # s
CJK = ("\u3400", "\u9fff")


def speaking_time(text: str) -> float:
    """How long a person would take to say ``text``, s."""
    chinese = sum(CJK[0] <= letter <= CJK[1] for letter in text)
    return max(SHORTEST, chinese / SYLLABLES_PER_SECOND + (len(text) - chinese) / LETTERS_PER_SECOND)


def spoken(text: str) -> Sound | None:
    """``text`` as the installed program says it; None if there is none or it fails. Blocks meanwhile."""
    program = shutil.which(PROGRAM)
    if program is None:
        return None
    chinese = any(CJK[0] <= letter <= CJK[1] for letter in text)
    command = [program, "-v", "cmn" if chinese else "en", "--stdin", "--stdout"]
    try:
        done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=SECONDS_MAX, check=True)
        return read_wav(io.BytesIO(done.stdout), name="speech")
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        log.warning("%s said nothing: %s", PROGRAM, error)
        return None
