"""cyberdog.gesture: gestures of any person (4.4.18)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal, Refused, RobotError
from roboglot.model.feed import Viewer
from roboglot.model.perception import Gesture, GestureSeen, Sighting
from roboglot.programs.functions.enums import GESTURES
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.senses.people import SENSITIVITY_MAX
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

DURATION_MIN, DURATION_MAX = 30, 300  # limits of the time for which recognition stays on, s
LOOK_EVERY = 0.04  # s
HELD = 1.0  # s for which a sighting counts

KINDS: dict[Gesture, str] = dict(
    zip(
        (
            Gesture.PULL, Gesture.PUSH, Gesture.UP, Gesture.DOWN, Gesture.LEFT, Gesture.RIGHT, Gesture.STOP,
            Gesture.THUMB_DOWN, Gesture.THUMB_UP, Gesture.OPEN, Gesture.CLOSE,
        ),
        GESTURES,
        strict=True,
    )
)  # fmt: skip


class GestureWatch:
    """Looks for gestures in the background until its time is up; keeps the time of each gesture's last sighting."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._viewer: Viewer[Sighting[GestureSeen]] | None = None
        self._until = 0.0
        self._seen: dict[str, float] = {}
        self._watching: asyncio.Task[None] | None = None

    @property
    def on(self) -> bool:
        """True while looking for gestures."""
        return self._viewer is not None and self._session.awake < self._until

    def open(self, seconds: float) -> None:
        """Look for gestures for ``seconds`` from now; pauses do not count. Raises ComponentMissing, Busy."""
        if not self.on:
            self.close()
            self._viewer = self._session.robot[Vision].gestures.subscribe()
            self._seen.clear()
            self._watching = asyncio.create_task(self._watch(self._viewer), name="look for gestures")
        self._until = self._session.awake + seconds

    def close(self) -> None:
        """Stop looking for gestures."""
        if self._viewer:
            self._viewer.close()
            self._viewer = None

    def seen(self, within: float) -> set[str]:
        """Return the gestures seen within the last ``within`` seconds, by the manual's names."""
        since = self._session.robot.clock.time() - within
        return {name for name, stamp in self._seen.items() if stamp >= since}

    async def _watch(self, viewer: Viewer[Sighting[GestureSeen]]) -> None:
        """Note what is seen until the time is up, or recognition is switched off."""
        async for sighting in viewer:
            if viewer.closed:
                return
            if self._session.awake >= self._until:
                self.close()
                return
            for gesture in sighting.seen:
                if gesture.gesture in KINDS:
                    self._seen[KINDS[gesture.gesture]] = sighting.stamp


@ABILITIES.on("cyberdog.gesture.turn_on_recognition", needs=(Vision,))
async def turn_on_recognition(session: Session, duration: int = 60) -> Record:
    """Look for gestures for ``duration`` s (30 to 300) while the program continues."""
    return _switched(lambda: session.part(GestureWatch).open(_seconds("duration", duration)))


@ABILITIES.on("cyberdog.gesture.turn_off_recognition")
async def turn_off_recognition(session: Session) -> Record:
    """Switch recognition off."""
    return _switched(lambda: session.part(GestureWatch).close())


@ABILITIES.on("cyberdog.gesture.recognized", needs=(Vision,))
async def recognized(session: Session, duration: int = 60, sensitivity: int = 1) -> Record:
    """Look for gestures for ``duration`` s and wait for one; those of the last ``sensitivity`` s count, too."""
    try:
        session.part(GestureWatch).open(_seconds("duration", duration))
    except RobotError as error:
        return _gestures(state(StateCode.FAIL, str(error)), set())
    return await _wait(session, duration, sensitivity)


@ABILITIES.on("cyberdog.gesture.recognized_any_gesture", needs=(Vision,))
async def recognized_any_gesture(session: Session, timeout: int = 60, sensitivity: int = 1) -> Record:
    """Wait for any gesture (30 to 300 s) while recognition is on; without one in time, all are False: no failure."""
    return await _wait(session, timeout, sensitivity)


@ABILITIES.on("cyberdog.gesture.recognized_designated_gesture", needs=(Vision,))
async def recognized_designated_gesture(session: Session, timeout: int = 60, gesture_type: int = 0) -> Record:
    """Wait for one gesture (1 to 300 s) while recognition is on; without it in time, all are False: no failure."""
    if not 1 <= gesture_type <= len(GESTURES):
        return _gestures(state(StateCode.FAIL, f"gesture_type = {gesture_type} is not a gesture"), set())
    return await _wait(session, timeout, 1, GESTURES[gesture_type - 1], least=1)


async def _wait(
    session: Session, timeout: int, sensitivity: int, wanted: str = "", least: int = DURATION_MIN
) -> Record:
    watch = session.part(GestureWatch)
    try:
        until = session.awake + _seconds("timeout", timeout, least)
        if not 0 <= sensitivity <= SENSITIVITY_MAX:
            raise InvalidGoal(f"sensitivity = {sensitivity} is outside of 0 to {SENSITIVITY_MAX} s")
        if not watch.on:
            raise Refused("gesture recognition is off")
    except RobotError as error:
        return _gestures(state(StateCode.FAIL, str(error)), set())
    within = max(HELD, sensitivity)
    while True:
        seen = watch.seen(within)
        if (wanted in seen) if wanted else seen:
            return _gestures(state(), seen)
        if session.awake >= until or not watch.on:
            return _gestures(state(), set())
        await session.sleep(LOOK_EVERY)


def _seconds(name: str, value: int, least: int = DURATION_MIN) -> float:
    if not least <= value <= DURATION_MAX:
        raise InvalidGoal(f"{name} = {value} is outside of {least} to {DURATION_MAX} s")
    return float(value)


def _switched(switch: Callable[[], None]) -> Record:
    outcome, code = state(), 0
    try:
        switch()
    except RobotError as error:
        outcome, code = state(StateCode.FAIL, str(error)), 1
    body = Record("GestureRecognizedSeviceResponseBody", {"code": code})
    return Record("GestureRecognizedSeviceResponse", {"state": outcome, "response": body})


def _gestures(outcome: Record, seen: set[str]) -> Record:
    data = Record("GestureData", dict.fromkeys(sorted(seen), True))
    return Record("GestureRecognizedMessageResponse", {"state": outcome, "data": data})
