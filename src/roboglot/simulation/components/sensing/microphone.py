"""The microphone: sound from the air and the room's noise, in blocks while it has listeners."""

from __future__ import annotations

import asyncio
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.microphone import BLOCK, Microphone
from roboglot.model.feed import Feed, Viewer
from roboglot.model.sound import SAMPLE_RATE, SoundBlock
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.sound.sound import SoundField

PERIOD = BLOCK / SAMPLE_RATE
QUEUE_MAX = 25  # blocks: half a second
BEHIND_MAX = 0.5  # s by which a slow machine may lag before sound is skipped


class MicrophoneSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``noise``: of the room, root mean square, as a share of full scale."""

    noise: Annotated[float, Meta(ge=0, le=0.5)]


class SimulatedMicrophone(Microphone):
    """Omnidirectional microphone in the middle of the robot."""

    def __init__(
        self, section: MicrophoneSection, hull: Hull, air: SoundField, clock: Clock, random: np.random.Generator
    ) -> None:
        self._noise, self._hull, self._air, self._clock, self._random = section.noise, hull, air, clock, random
        self._feed: Feed[SoundBlock] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._listening: asyncio.Task[None] | None = None

    def subscribe(self) -> Viewer[SoundBlock]:
        return self._feed.subscribe()

    def close(self) -> None:
        """Stop listening."""
        self._feed.close()

    def _begin(self) -> None:
        self._listening = asyncio.get_running_loop().create_task(self._listen(), name="microphone")

    def _end(self) -> None:
        if self._listening is not None:
            self._listening.cancel()
            self._listening = None

    async def _listen(self) -> None:
        begin, block = self._clock.time(), 0
        while True:
            await self._clock.sleep_until(begin + (block + 1) * PERIOD)
            late = self._clock.time() - begin - (block + 1) * PERIOD
            if late > BEHIND_MAX:
                block += int(late / PERIOD)
            self._feed.push(self._block(begin + block * PERIOD))
            block += 1

    def _block(self, start: float) -> SoundBlock:
        heard = self._air.heard(self._hull.pose.point, self._hull.floor, start, BLOCK)
        heard += self._random.standard_normal(BLOCK) * (self._noise * 32767.0)
        samples = np.clip(np.rint(heard), -32768, 32767).astype(np.int16)
        samples.setflags(write=False)
        return SoundBlock(start, samples)


def _fit(fit: Fitting) -> SimulatedMicrophone:
    section, chance = fit.body[MicrophoneSection], fit.chance("microphone")
    return SimulatedMicrophone(section, fit.hull, fit.world.air, fit.robot.clock, chance)


PART = Part(
    name="microphone",
    interface=Microphone,
    section=MicrophoneSection,
    fit=_fit,
    detach=SimulatedMicrophone.close,
)
