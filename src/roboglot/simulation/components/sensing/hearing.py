"""Hearing: claps counted in the microphone's sound, and words loud enough to be understood.

Speech recognition is not simulated: words are passed along with the sound, and lost with it.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import math
from collections.abc import Callable, Coroutine
from functools import partial

from msgspec import Struct

from roboglot.model.claps import ClapCounter
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.feed import Feed, Viewer
from roboglot.model.perception import ClapsHeard, SpeechHeard
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.sensing.microphone import MicrophoneSection
from roboglot.simulation.sound.sound import Heard, SoundField

log = logging.getLogger(__name__)
QUEUE_MAX = 20
BEAT = 0.1  # s
LATENCY = 0.3  # s from the end of an utterance to its recognition
AUDIBLE, CLEAR = 3.0, 6.0  # times the noise from which a voice is noticed, and its words are understood
FULL_SCALE = 32767.0


class HearingSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Recognition of the microphone's sound."""


class SimulatedHearing(Hearing):
    """Hearing; ``noise``: of microphone and room, root mean square, as a share of full scale."""

    def __init__(self, robot: Robot, hull: Hull, air: SoundField, noise: float) -> None:
        self._robot, self._hull, self._air, self._noise = robot, hull, air, noise * FULL_SCALE
        self._claps: Feed[ClapsHeard] = Feed(
            partial(self._begin, "claps", self._count), partial(self._end, "claps"), queue_max=QUEUE_MAX
        )
        self._speech: Feed[SpeechHeard] = Feed(
            partial(self._begin, "speech", self._listen), partial(self._end, "speech"), queue_max=QUEUE_MAX
        )
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def claps(self) -> Viewer[ClapsHeard]:
        return self._claps.subscribe()

    def speech(self) -> Viewer[SpeechHeard]:
        return self._speech.subscribe()

    def close(self) -> None:
        """Stop hearing."""
        self._claps.close()
        self._speech.close()

    def _begin(self, name: str, listening: Callable[[], Coroutine[None, None, None]]) -> None:
        self._tasks[name] = asyncio.get_running_loop().create_task(_logged(listening()), name=f"hearing {name}")

    def _end(self, name: str) -> None:
        self._tasks.pop(name).cancel()

    async def _count(self) -> None:
        counter = ClapCounter()
        with self._robot[Microphone].subscribe() as blocks:
            async for block in blocks:
                heard = counter.feed(block)
                if heard is not None:
                    self._claps.push(heard)

    async def _listen(self) -> None:
        clock = self._robot.clock
        since = clock.time() - LATENCY
        async for now in clock.every(BEAT):
            until = now - LATENCY
            for heard in self._air.utterances(self._hull.pose.point, self._hull.floor, since, until):
                speech = self._understood(heard, until)
                if speech is not None:
                    self._speech.push(speech)
            since = until

    def _understood(self, heard: Heard, stamp: float) -> SpeechHeard | None:
        speech = heard.source.speech
        assert speech is not None
        clarity = heard.level / max(1e-9, math.hypot(heard.noise, self._noise))
        if speech.voice == own_voice(self._robot.id) or clarity < AUDIBLE:
            return None
        known = self._voices() if clarity >= CLEAR else {}
        return SpeechHeard(
            stamp=stamp,
            seconds=heard.source.sound.seconds,
            text=speech.text if clarity >= CLEAR else "",
            print=speech.voice,
            name=known.get(speech.voice, ""),
            loudness=20.0 * math.log10(max(1e-9, heard.level) / FULL_SCALE),
        )

    def _voices(self) -> dict[bytes, str]:
        """Return the names of members by their enrolled voices."""
        if Members not in self._robot:
            return {}
        return {member.voice: member.name for member in self._robot[Members].all() if member.voice is not None}


async def _logged(listening: Coroutine[None, None, None]) -> None:
    """Await ``listening``, and log its exception: no other task awaits it."""
    try:
        await listening
    except Exception:
        log.exception("the hearing crashed")


def own_voice(robot: str) -> bytes:
    """Return the voiceprint of a robot's own voice."""
    return hashlib.sha256(f"voice of robot {robot}".encode()).digest()


def _fit(fit: Fitting) -> SimulatedHearing:
    return SimulatedHearing(fit.robot, fit.hull, fit.world.air, fit.body[MicrophoneSection].noise)


PART = Part(
    name="hearing",
    interface=Hearing,
    section=HearingSection,
    needs=("microphone",),
    fit=_fit,
    after=("microphone",),
    detach=SimulatedHearing.close,
)
