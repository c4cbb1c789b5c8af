"""cyberdog.skeleton: counting a person's exercises (4.4.19). The person seen first is counted."""

from __future__ import annotations

import asyncio
from enum import IntEnum

from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal, Refused, RobotError
from roboglot.model.feed import Viewer
from roboglot.model.perception import Sighting, SkeletonSeen, Sport
from roboglot.model.sports import SportCounter
from roboglot.programs.functions.audio import comment, turn_to, usable_volume
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

TIMEOUT_MIN, TIMEOUT_MAX = 5, 300  # s
COUNTS_MAX = 10_000
LOOK_EVERY = 0.04  # s
SUCCESS, FAILED = 0, 1  # response.result
SPORTS = dict(  # SkeletonType
    enumerate((Sport.SQUAT, Sport.HIGH_KNEES, Sport.SIT_UP, Sport.PUSH_UP, Sport.PLANK, Sport.JUMPING_JACK), 1)
)


class Switch(IntEnum):
    """State of algo_switch: open, or the reason why it is closed."""

    OPEN = 0
    COMPLETE = 1
    TIMEOUT = 2
    CLOSED = 3


class ExerciseWatch:
    """Counts in the background, until the wanted number is reached or the time is up."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._switch = Switch.CLOSED
        self._sport_type = 0
        self._until = 0.0
        self._counter: SportCounter | None = None
        self._viewer: Viewer[Sighting[SkeletonSeen]] | None = None
        self._watching: asyncio.Task[None] | None = None

    @property
    def progress(self) -> tuple[Switch, int, int, int]:
        """Values of algo_switch, sport_type, counts and duration (s)."""
        if self._switch is Switch.OPEN and self._session.awake >= self._until:
            self._end(Switch.TIMEOUT)
        counter = self._counter
        counts, seconds = (counter.count, int(counter.duration)) if counter else (0, 0)
        return self._switch, self._sport_type, counts, seconds

    def open(self, sport_type: int, counts: int, timeout: float) -> None:
        """Start counting from 0. Raises InvalidGoal, ComponentMissing, Busy."""
        if sport_type not in SPORTS:
            raise InvalidGoal(f"sport_type = {sport_type} does not exist")
        if not 1 <= counts <= COUNTS_MAX:
            raise InvalidGoal(f"counts = {counts} is outside of 1 to {COUNTS_MAX}")
        seconds = usable(timeout)
        self.close()
        self._viewer = self._session.robot[Vision].skeletons.subscribe()
        self._counter = SportCounter(SPORTS[sport_type])
        self._sport_type, self._switch = sport_type, Switch.OPEN
        self._until = self._session.awake + seconds
        watch = self._watch(self._viewer, self._counter, counts)
        self._watching = asyncio.create_task(watch, name="count exercises")

    def close(self) -> None:
        """Stop counting."""
        if self._switch is Switch.OPEN:
            self._end(Switch.CLOSED)

    async def _watch(self, viewer: Viewer[Sighting[SkeletonSeen]], counter: SportCounter, wanted: int) -> None:
        """Count until ``wanted``, or until the time is up; what was seen later does not count."""
        who: int | None = None
        async for sighting in viewer:
            if viewer.closed:  # counting was ended, or began anew, before this was read
                return
            if self._session.awake >= self._until:
                self._end(Switch.TIMEOUT)
                return
            for skeleton in sighting.seen:
                who = skeleton.number if who is None else who
                if skeleton.number == who:
                    counter.see(skeleton, sighting.stamp)
            done = counter.duration if counter.sport is Sport.PLANK else counter.count
            if done >= wanted:
                self._end(Switch.COMPLETE)
                return

    def _end(self, why: Switch) -> None:
        self._switch = why
        if self._viewer:
            self._viewer.close()  # this also ends ``_watch``


@ABILITIES.on("cyberdog.skeleton.turn_on_recognition", needs=(Vision,))
async def turn_on_recognition(session: Session, sport_type: int, counts: int, timeout: float = 100.0) -> Record:
    """Count a sport (SkeletonType) up to ``counts`` (a plank's seconds) for at most ``timeout`` s, 5 to 300."""
    try:
        session.part(ExerciseWatch).open(sport_type, counts, timeout)
    except RobotError as error:
        return _switched(state(StateCode.FAIL, str(error)))
    return _switched(state())


@ABILITIES.on("cyberdog.skeleton.turn_off_recognition")
async def turn_off_recognition(session: Session) -> Record:
    """Stop counting."""
    session.part(ExerciseWatch).close()
    return _switched(state())


@ABILITIES.on("cyberdog.skeleton.instant_recognized")
async def instant_recognized(session: Session) -> Record:
    """Return the current count."""
    return _message(session, state())


@ABILITIES.on("cyberdog.skeleton.blocking_recognized", needs=(Vision,))
async def blocking_recognized(session: Session, timeout: float = 100.0) -> Record:
    """Wait for the next repetition, second of a plank, or end of counting; at most ``timeout`` s, 5 to 300."""
    watch = session.part(ExerciseWatch)
    try:
        seconds = usable(timeout)
        if watch.progress[0] is not Switch.OPEN:
            raise Refused("nothing is being counted")
    except RobotError as error:
        return _message(session, state(StateCode.FAIL, str(error)))
    await _change(session, watch, seconds)
    return _message(session, state())


@ABILITIES.on("cyberdog.skeleton.sports_recognition", needs=(Speaker, Vision))
async def sports_recognition(
    session: Session,
    sport_type: int,
    counts: int,
    timeout: float = 100.0,
    interact: bool = True,
    instantly: bool = True,
    volume: int = 50,
) -> Record:
    """Count up to ``counts`` or until the time is up; ``interact``: say the counts; ``instantly``: not one by one."""
    watch = session.part(ExerciseWatch)
    try:
        usable_volume(volume)
        watch.open(sport_type, counts, timeout)
        if interact:
            await turn_to(session.robot[Speaker], volume)
        while watch.progress[0] is Switch.OPEN:
            if await _change(session, watch, timeout) and interact:
                number = str(watch.progress[2] or watch.progress[3])
                if instantly:
                    session.robot[Speaker].say(number, source=session.source)
                else:
                    await comment(session, number)
        if interact:
            await comment(session, "done" if watch.progress[0] is Switch.COMPLETE else "time is up")
    except RobotError as error:
        watch.close()
        return _sports(session, state(StateCode.FAIL, str(error)), FAILED)
    return _sports(session, state(), SUCCESS if watch.progress[0] is Switch.COMPLETE else FAILED)


async def _change(session: Session, watch: ExerciseWatch, seconds: float) -> bool:
    """Wait for any progress, at most ``seconds``; return whether counts or duration changed."""
    before, until = watch.progress, session.awake + seconds
    while watch.progress == before and session.awake < until:
        await session.sleep(LOOK_EVERY)
    return watch.progress[2:] != before[2:]


def usable(timeout: float) -> float:
    """Return a timeout, s. Raises InvalidGoal beyond 5 to 300 s."""
    if not TIMEOUT_MIN <= timeout <= TIMEOUT_MAX:
        raise InvalidGoal(f"timeout = {timeout:g} is outside of {TIMEOUT_MIN} to {TIMEOUT_MAX} s")
    return float(timeout)


def _switched(outcome: Record) -> Record:
    body = Record("SkeletonRecognizedSeviceResponseBody", {"result": FAILED if outcome.fields["code"] else SUCCESS})
    return Record("SkeletonRecognizedSeviceResponse", {"state": outcome, "response": body})


def _fields(session: Session) -> dict[str, int]:
    names = ("algo_switch", "sport_type", "counts", "duration")
    return dict(zip(names, map(int, session.part(ExerciseWatch).progress), strict=True))


def _message(session: Session, outcome: Record) -> Record:
    body = Record("SkeletonRecognizedMessageResponseBody", _fields(session))
    return Record("SkeletonRecognizedMessageResponse", {"state": outcome, "response": body})


def _sports(session: Session, outcome: Record, result: int) -> Record:
    body = Record("SportsRecognizedResponseBody", {"result": result, **_fields(session)})
    return Record("SportsRecognizedResponse", {"state": outcome, "response": body})
