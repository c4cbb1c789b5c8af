"""cyberdog.personnel and cyberdog.train: members known by face and voice, and trained words (4.4.07, 4.4.20)."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.interaction.training_words import TrainedWord, TrainingWords
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal, NotFound, RobotError
from roboglot.model.perception import Emotion, FaceSeen, SpeechHeard
from roboglot.model.robot import Robot
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.senses.skeletons import usable
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

LOOK_EVERY = 0.04  # s
HEARD_MAX = 100  # utterances kept
SENSITIVITY_MAX = 60  # s
EMOTIONS = tuple(Emotion)  # a face's emotion is its index here, as at the app's door
# Words of an untrained robot: end, pause and continue the tasks.
WORDS = tuple(
    TrainedWord(*word) for word in (("终止任务", "shutdown"), ("暂停任务", "suspend"), ("继续任务", "recover"))
)


class SpeechListener:
    """Speech of people, kept from the first use until the program ends."""

    def __init__(self, session: Session) -> None:
        self._viewer = session.robot[Hearing].speech()
        self._heard: deque[SpeechHeard] = deque(maxlen=HEARD_MAX)

    def heard(self, since: float) -> list[SpeechHeard]:
        """Return the utterances that ended after ``since`` (robot time, s)."""
        self._heard.extend(self._viewer.drain())
        return [speech for speech in self._heard if speech.stamp > since]

    def close(self) -> None:
        """Stop listening."""
        self._viewer.close()


@ABILITIES.on("cyberdog.personnel.face_recognized", needs=(Members, Vision))
async def face_recognized(
    session: Session, personnel_ids: list[str], and_operation: bool = False, duration: float = 60.0
) -> Record:
    """Wait for the faces of these members (names or ids; none: any member), of all or of any; 30 to 300 s."""
    found: dict[str, FaceSeen] = {}
    outcome = state()
    try:
        _check("duration", duration, 30, 300)
        wanted = _named(session.robot, personnel_ids)
        with session.robot[Vision].faces.subscribe() as viewer:
            until = session.awake + duration
            while not _enough(found.keys(), wanted, personnel_ids and and_operation) and session.awake < until:
                await session.sleep(LOOK_EVERY)
                found |= {face.name: face for look in viewer.drain() for face in look.seen if face.name in wanted}
        if not _enough(found.keys(), wanted, personnel_ids and and_operation):
            outcome = state(StateCode.FAIL, "time is up")
    except RobotError as error:
        outcome = state(StateCode.FAIL, str(error))
    people = {name: _seen(face) for name, face in found.items()}
    fields = {"state": outcome, "list": list(people.values()), "dictionary": people}
    return Record("FaceRecognizedSeviceResponse", fields)


@ABILITIES.on("cyberdog.personnel.voiceprint_recognized", needs=(Members,))
async def voiceprint_recognized(
    session: Session, names: list[str], and_operation: bool = False, duration: float = 3.0, sensitivity: int = 1
) -> Record:
    """Wait for the voices of these members (none: any member), of all or of any; 1 to 30 s.

    What was said in the last ``sensitivity`` seconds counts, if the program was listening already. No match in time is
    ``data`` False, and no failure.
    """
    heard: dict[str, None] = {}
    wanted: set[str] = set()
    everyone = bool(names) and and_operation
    try:
        _check("duration", duration, 1, 30)
        _check("sensitivity", sensitivity, 0, SENSITIVITY_MAX)
        wanted = _named(session.robot, names)
        listener, since = session.part(SpeechListener), session.robot.clock.time() - sensitivity
        until = session.awake + duration
        while not _enough(heard.keys(), wanted, everyone) and session.awake < until:
            await session.sleep(LOOK_EVERY)
            heard |= {speech.name: None for speech in listener.heard(since) if speech.name in wanted}
    except RobotError as error:
        return Record("VoiceprintRecognized", {"state": state(StateCode.FAIL, str(error))})
    fields = {"state": state(), "list": list(heard), "data": _enough(heard.keys(), wanted, everyone)}
    return Record("VoiceprintRecognized", fields)


@ABILITIES.on("cyberdog.train.get_training_words_set")
async def get_training_words_set(session: Session) -> Record:
    """Return the words that the robot listens for: three built-in ones, and those it was taught."""
    words = {word.trigger: _word(word) for word in known_words(session.robot)}
    response = Record("TrainingSet", {"training_set": list(words.values())})
    fields = {"state": state(), "response": response, "dictionary": words}
    return Record("TrainingWordsRecognizedSeviceResponse", fields)


@ABILITIES.on("cyberdog.train.training_words_recognized", needs=(Hearing,))
async def training_words_recognized(session: Session, timeout: float = 5.0) -> Record:
    """Wait until one of these words is said (5 to 300 s); without one in time, it is empty: no failure."""
    outcome, word = state(), Record("MsgTrainingWords")
    try:
        until, since = session.awake + usable(timeout), session.robot.clock.time()
        listener = session.part(SpeechListener)
        while not word.fields and session.awake < until:
            await session.sleep(LOOK_EVERY)
            said = [speech.text.strip() for speech in listener.heard(since)]
            known = {word.trigger: word for word in known_words(session.robot)}
            word = next((_word(known[text]) for text in said if text in known), word)
    except RobotError as error:
        outcome = state(StateCode.FAIL, str(error))
    return Record("TrainingWordsRecognizedMessageResponse", {"state": outcome, "response": word})


def known_words(robot: Robot) -> list[TrainedWord]:
    """Return the words that the robot listens for; a taught word replaces a built-in one."""
    words = {word.trigger: word for word in WORDS}
    if TrainingWords in robot:
        words |= {word.trigger: word for word in robot[TrainingWords].all()}
    return list(words.values())


def _word(word: TrainedWord) -> Record:
    return Record("MsgTrainingWords", {"trigger": word.trigger, "type": word.kind, "value": word.value})


def _seen(face: FaceSeen) -> Record:
    emotion = float(EMOTIONS.index(face.emotion))
    return Record("FaceRecognitionResult", {"username": face.name, "age": face.age, "emotion": emotion})


def _named(robot: Robot, people: list[str]) -> set[str]:
    """Return the members' names for names or ids; all members for an empty list. Raises NotFound, ComponentMissing."""
    members = robot[Members].all()
    names = {member.name for member in members}
    if not people:
        if not names:
            raise NotFound("the robot knows no members yet")
        return names
    by_id = {str(member.id): member.name for member in members}
    unknown = [person for person in people if person not in names and person not in by_id]
    if unknown:
        raise NotFound(f"the robot does not know {unknown[0]!r}")
    return {person if person in names else by_id[person] for person in people}


def _enough(found: Iterable[str], wanted: set[str], everyone: object) -> bool:
    present = wanted & set(found)
    return present == wanted if everyone else bool(present)


def _check(name: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        given = f"{value:g}" if isinstance(value, float) else str(value)  # a whole number may be too large for ``g``
        raise InvalidGoal(f"{name} = {given} is outside of {least:g} to {most:g} s")
