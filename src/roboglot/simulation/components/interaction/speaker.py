"""The loudspeaker: emits speech and sounds into the air, and publishes an event at the end of each."""

from __future__ import annotations

import asyncio
import logging
from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.actions import Action
from roboglot.model.clock import RealClock
from roboglot.model.components.interaction.speaker import SPEAKER, Speaker, check_text, check_volume
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Refused
from roboglot.model.events import SoundPlayed, Spoke
from roboglot.model.robot import Robot
from roboglot.model.sound import Sound
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.sensing.hearing import own_voice
from roboglot.simulation.sound.sound import SoundField, Source, Speech
from roboglot.simulation.sound.voice import speaking_time, spoken

log = logging.getLogger(__name__)
VOLUME = "speaker.volume"  # the setting
BUILT = 0.7  # volume of a new robot


class SpeakerSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``loudness``: amplitude at full volume 1 m away, as a share of a microphone's full scale."""

    loudness: Annotated[float, Meta(gt=0, le=10)]


class SimulatedSpeaker(Speaker):
    """Speaker; without a voice on this machine, a text takes its time but is silent."""

    def __init__(self, section: SpeakerSection, hull: Hull, air: SoundField, robot: Robot) -> None:
        self._loudness, self._hull, self._air, self._robot = section.loudness, hull, air, robot
        self._volume: float | None = None

    @property
    def volume(self) -> float:
        if self._volume is None:
            kept = self._robot[Settings].get(VOLUME, BUILT) if Settings in self._robot else BUILT
            self._volume = float(kept)
        return self._volume

    async def set_volume(self, volume: float) -> None:
        check_volume(volume)
        if Settings in self._robot:
            await self._robot[Settings].put(VOLUME, volume)
        self._volume = volume

    def say(self, text: str, *, source: str = "") -> Action:
        check_text(text)

        async def run(_action: Action) -> None:
            threaded = isinstance(self._robot.clock, RealClock)
            sound = await asyncio.to_thread(spoken, text) if threaded else spoken(text)
            seconds = sound.seconds if sound else speaking_time(text)
            await self._sound(sound, seconds, Speech(text, own_voice(self._robot.id)))
            log.info("robot %s said: %s", self._robot.id, text)
            stamp = self._robot.clock.time()
            self._robot.events.publish(Spoke(stamp=stamp, text=text, seconds=seconds, audible=sound is not None))

        return self._robot.actions.start("say", run, resources=[SPEAKER], goal=text, source=source)

    def play(self, sound: Sound, *, source: str = "") -> Action:
        async def run(_action: Action) -> None:
            await self._sound(sound, sound.seconds, None)
            log.info("robot %s played: %s", self._robot.id, sound.name)
            stamp = self._robot.clock.time()
            self._robot.events.publish(SoundPlayed(stamp=stamp, name=sound.name, seconds=sound.seconds))

        return self._robot.actions.start("play", run, resources=[SPEAKER], goal=sound.name, source=source)

    async def _sound(self, sound: Sound | None, seconds: float, speech: Speech | None) -> None:
        """Play the sound, if any, and wait ``seconds`` for its end; silence it when cancelled. Raises Refused."""
        clock, hull = self._robot.clock, self._hull
        if sound is None:
            await clock.sleep(seconds)
            return
        loudness = self._loudness * self.volume
        source = Source(sound, hull.pose.point, hull.floor, clock.time(), loudness, speech)
        try:
            self._air.emit(source)
        except ValueError as error:
            raise Refused(str(error)) from None
        try:
            await clock.sleep(seconds)
        except BaseException:
            self._air.silence(source)
            raise


def _fit(fit: Fitting) -> SimulatedSpeaker:
    return SimulatedSpeaker(fit.body[SpeakerSection], fit.hull, fit.world.air, fit.robot)


PART = Part(name="speaker", interface=Speaker, section=SpeakerSection, fit=_fit)
