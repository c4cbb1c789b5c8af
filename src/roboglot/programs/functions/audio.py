"""cyberdog.audio: speaking, sounds, volume (4.4.08). Volumes are in percent; -1 changes nothing."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from roboglot.media.tunes import evening_waltz, romp
from roboglot.model.actions import Action
from roboglot.model.components.interaction.speaker import SPEAKER, Speaker, check_text
from roboglot.model.errors import Busy, InvalidGoal, NotFound, RobotError
from roboglot.model.sound import SAMPLE_RATE, Sound
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

log = logging.getLogger(__name__)
PLAYED, FAILED = 0, 1  # AudioPlaySeviceResponse.response.status
UNCHANGED = -1
BARKS = {4000: 620.0, 4001: 260.0}  # Hz of their first tone
PIECES: Mapping[int, Callable[[], Sound]] = {6000: cache(romp), 6001: cache(evening_waltz)}  # slow to make: 0.1 s


@ABILITIES.on("cyberdog.audio.play", needs=(Speaker,))
async def play(session: Session, message: str, volume: int = UNCHANGED) -> Record:
    """Say ``message`` after the present speech; returns at its end."""
    return await _played(session, message, volume)


@ABILITIES.on("cyberdog.audio.offline_play", needs=(Speaker,))
async def offline_play(session: Session, audio_id: int = 4000, volume: int = UNCHANGED) -> Record:
    """Play a bark (4000, 4001) or music (6000, 6001) after the present sound; returns at its end."""
    return await _played(session, audio_id, volume)


@ABILITIES.on("cyberdog.audio.instantly_play", needs=(Speaker,))
async def instantly_play(session: Session, message: str, volume: int = UNCHANGED) -> Record:
    """Say ``message`` now, in place of anything being said; returns at once. Speech ends with the program."""
    return await _started(session, message, volume)


@ABILITIES.on("cyberdog.audio.offline_instantly_play", needs=(Speaker,))
async def offline_instantly_play(session: Session, audio_id: int = 4000, volume: int = UNCHANGED) -> Record:
    """Play a bark (4000, 4001) or music (6000, 6001) now, in place of any other; ends with the task."""
    return await _started(session, audio_id, volume)


@ABILITIES.on("cyberdog.audio.get_volume", needs=(Speaker,))
async def get_volume(session: Session) -> Record:
    """Return the current volume."""
    percent = round(session.robot[Speaker].volume * 100)
    fields = {"state": state(), "response": Record("AudioGetVolumeSeviceResponseBody", {"volume": percent})}
    return Record("AudioGetVolumeSeviceResponse", fields)


@ABILITIES.on("cyberdog.audio.set_volume", needs=(Speaker,))
async def set_volume(session: Session, volume: int = UNCHANGED) -> Record:
    """Set the volume of all speech from now on."""
    outcome = state()
    try:
        await turn_to(session.robot[Speaker], volume)
    except RobotError as error:
        outcome = state(StateCode.FAIL, str(error))
    body = Record("AudioSetVolumeSeviceResponseBody", {"success": outcome.fields["code"] == StateCode.SUCCESS})
    return Record("AudioSetVolumeSeviceResponse", {"state": outcome, "response": body})


async def turn_to(speaker: Speaker, volume: int) -> None:
    """Set and store the volume, percent; -1 changes nothing. Raises InvalidGoal beyond 0 to 100."""
    if volume != UNCHANGED:
        await speaker.set_volume(usable_volume(volume) / 100)


def usable_volume(volume: int) -> int:
    """Return a volume in percent (table 4.1). Raises InvalidGoal beyond 0 to 100."""
    if not 0 <= volume <= 100:
        raise InvalidGoal(f"volume = {volume} is outside of 0 to 100 %")
    return volume


async def say(session: Session, what: str | int, volume: int = UNCHANGED) -> None:
    """Wait until the speaker is free, then say a text or play a sound to its end. Raises RobotError."""
    _check_sound(what)
    await _silence(session)
    if volume != UNCHANGED:
        await turn_to(session.robot[Speaker], volume)
        await _silence(session)  # another may have begun while the volume was stored
    await session.complete(_begin(session, what))


async def _silence(session: Session) -> None:
    """Wait until nothing sounds and the program is not paused; of several that wait, one begins, the others go on."""
    await session.unpaused()
    while sounding := session.robot.actions.running(SPEAKER):
        await sounding[0].done()
        await session.unpaused()


async def comment(session: Session, what: str) -> None:
    """Say how it goes; another client that speaks in between does not make it go worse."""
    try:
        await say(session, what)
    except RobotError as error:
        log.info("%s: cannot say %r: %s", session.source, what, error)


async def _played(session: Session, what: str | int, volume: int) -> Record:
    outcome, status = state(), PLAYED
    try:
        await say(session, what, volume)
    except RobotError as error:
        outcome, status = state(StateCode.FAIL, str(error)), FAILED
    body = Record("AudioPlaySeviceResponseBody", {"status": status})
    return Record("AudioPlaySeviceResponse", {"state": outcome, "response": body})


async def _started(session: Session, what: str | int, volume: int) -> Record:
    try:
        _check_sound(what)  # before the volume changes
        await turn_to(session.robot[Speaker], volume)
        _begin(session, what)
    except RobotError as error:
        return state(StateCode.FAIL, str(error))
    return state()


def _check_sound(what: str | int) -> None:
    """Raise NotFound for the number of no sound, InvalidGoal for a text that cannot be said."""
    if isinstance(what, str):
        check_text(what)
    elif what not in BARKS.keys() | PIECES.keys():
        raise NotFound(f"there is no sound {what}; there are: {', '.join(map(str, [*BARKS, *PIECES]))}")


def _begin(session: Session, what: str | int) -> Action:
    """Start saying a text, or playing the sound of a number. Raises Busy once the program has ended."""
    if session.ended:
        raise Busy("the program has ended")
    speaker = session.robot[Speaker]
    if isinstance(what, int):
        sound = PIECES[what]() if what in PIECES else bark(what)
        return speaker.play(sound, source=session.source)
    return speaker.say(what, source=session.source)


@cache
def bark(number: int) -> Sound:
    """Return two woofs: a rough voice that falls and dies away."""
    time = np.arange(round(0.22 * SAMPLE_RATE)) / SAMPLE_RATE
    phase = 2 * np.pi * BARKS[number] * (time - 1.2 * time**2)
    voice = sum(np.sin(overtone * phase) / overtone for overtone in range(1, 7))
    woof = voice * np.sin(np.pi * time / time[-1]) ** 0.5 * np.exp(-time / 0.12)
    silence = np.zeros(round(0.15 * SAMPLE_RATE))
    whole = np.concatenate((woof, silence, woof))
    samples = np.rint(whole / np.abs(whole).max() * 20_000).astype(np.int16)
    return Sound(f"bark {number}", samples)
