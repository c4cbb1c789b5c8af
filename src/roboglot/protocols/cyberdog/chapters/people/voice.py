"""The voice board: listens for its wake word and obeys commands; learns members' voices. Knows no message.

Hears only while a feature needs it and the microphone is on.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.events import MembersChanged
from roboglot.model.perception import SpeechHeard
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.motion.gait import NOTHING_SPECIAL, Gaits
from roboglot.protocols.cyberdog.chapters.people.expected_member import ExpectedMember
from roboglot.protocols.cyberdog.chapters.system.stored_settings import MICROPHONE, VOICE_CONTROL, kept, wake_words
from roboglot.wire.cyberdog.chapters.motion.motion import Motion, MotionCode

log = logging.getLogger(__name__)
TRAINING_MAX = 30.0  # s for a person to speak
ATTENTIVE = 8.0  # s for which it listens for a command after its wake word
HERE, CANNOT = "我在", "现在不行"
ORDERS = {
    "站起来": Motion.STAND_UP,
    "stand up": Motion.STAND_UP,
    "趴下": Motion.LIE_DOWN,
    "lie down": Motion.LIE_DOWN,
    "坐下": Motion.SIT_DOWN,
    "sit down": Motion.SIT_DOWN,
}
TRAINED, TIMEOUT, UNKNOWN, FAILED = 0, 5007, 5010, 5001  # ``code`` of 3013


class Voice:
    """Lives as long as the door is open. ``trained(code, voiceprint_id)`` is called when a training has ended."""

    def __init__(self, robot: Robot, gaits: Gaits, trained: Callable[[int, str], None]) -> None:
        self._expected = ExpectedMember(robot)
        self._voiceprint = ""  # that is being learned
        self._robot, self._gaits, self._trained = robot, gaits, trained
        self._listening: asyncio.Task[None] | None = None
        self._learning: asyncio.Task[None] | None = None
        self._obeying: asyncio.Task[MotionCode] | None = None
        self._attentive_until = 0.0
        self._leave = robot.events.listen(MembersChanged, self._end_if_removed)

    @property
    def training(self) -> str:
        """The member whose voice is being learned, by the present name; "" for none."""
        return self._expected.name

    @property
    def microphone(self) -> bool:
        """True if the microphone is on."""
        return Hearing in self._robot and bool(kept(self._robot, MICROPHONE, True))

    @property
    def controlled(self) -> bool:
        """True if voice control is on."""
        return Hearing in self._robot and bool(kept(self._robot, VOICE_CONTROL, False))

    def adapt(self) -> None:
        """Start or stop listening, according to the settings."""
        if self.microphone and self.controlled:
            if self._listening is None:
                self._listening = asyncio.get_running_loop().create_task(self._listen(), name="voice control")
        elif self._listening:
            self._listening.cancel()
            self._listening = None
        if not self.microphone and self._learning:
            self._fail(FAILED)

    def train(self, member: str, voiceprint: str) -> None:
        """Learn the next speaker's voice as ``member``'s; replaces an earlier request."""
        self.stop_training()
        self._voiceprint = voiceprint
        self._learning = asyncio.get_running_loop().create_task(self._learn(member, voiceprint), name="voiceprint")

    def stop_training(self) -> None:
        """Stop learning a voice, without a report."""
        if self._learning:
            self._learning.cancel()
        self._learning = None
        self._expected.clear()

    def close(self) -> None:
        """Stop listening for good."""
        self._leave()
        self.stop_training()
        if self._listening:
            self._listening.cancel()

    async def _learn(self, member: str, voiceprint: str) -> None:
        code = FAILED
        try:
            if not self.microphone:
                return
            self._expected.expect(member)
            print_ = await self._robot.clock.wait_for(self._next_voice(), TRAINING_MAX)
            await self._robot[Members].set_voice(self.training, print_)
            code = TRAINED
        except TimeoutError:
            code = TIMEOUT
        except RobotError as error:
            log.info("cannot learn the voice of %r: %s", member, error)
            code = UNKNOWN if isinstance(error, NotFound) else FAILED
        finally:
            if self._learning is asyncio.current_task():  # unless it was cancelled
                self._learning = None
                self._expected.clear()
                self._trained(code, voiceprint)

    def _fail(self, code: int) -> None:
        """Stop learning a voice, and report it."""
        self.stop_training()
        self._trained(code, self._voiceprint)

    def _end_if_removed(self, _event: MembersChanged) -> None:
        if self._learning and self._expected.removed:
            self._fail(UNKNOWN)

    async def _next_voice(self) -> bytes:
        with self._robot[Hearing].speech() as speech:
            async for said in speech:
                if said.print:
                    return said.print
        raise RobotError("the microphone is gone")

    async def _listen(self) -> None:
        with self._robot[Hearing].speech() as speech:
            async for said in speech:
                try:
                    self._execute(said)
                except RobotError as error:
                    log.info("cannot obey %r: %s", said.text, error)

    def _execute(self, said: SpeechHeard) -> None:
        text, now = said.text.casefold(), self._robot.clock.time()
        called = any(word.casefold() in text for word in wake_words(self._robot))
        if called:
            self._attentive_until = now + ATTENTIVE
        elif now > self._attentive_until:
            return
        order = next((motion for words, motion in ORDERS.items() if words in text), None)
        if order is None:
            if called:
                self._speak(HERE)
        elif self._gaits.check(order, NOTHING_SPECIAL):
            self._speak(CANNOT)
        else:
            self._obeying = asyncio.get_running_loop().create_task(self._gaits.carry_out(order, NOTHING_SPECIAL))

    def _speak(self, text: str) -> None:
        if Speaker in self._robot:
            self._robot[Speaker].say(text, source="cyberdog voice")
