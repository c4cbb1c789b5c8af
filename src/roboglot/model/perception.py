"""Results of perception in pictures, scans and sounds. Values only; knows no sensor.

In a picture, x runs from 0 (left edge) to 1 (right edge) and y from 0 (top) to 1 (bottom). Places are in base_link, m.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Generic, TypeVar

from roboglot.model.geometry import Point, Pose
from roboglot.values import dataclass

T = TypeVar("T")
LINE_POINTS = 10
JOINTS = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Box:
    """A region of a picture: its middle and its extent."""

    x: float
    y: float
    width: float
    height: float

    def contains(self, x: float, y: float) -> bool:
        """True if a place in the picture lies within."""
        return abs(x - self.x) <= self.width / 2 and abs(y - self.y) <= self.height / 2


class Colour(StrEnum):
    """Colour of markers and of lines on the floor."""

    RED = "red"
    GREEN = "green"
    BLUE = "blue"
    YELLOW = "yellow"
    BLACK = "black"
    WHITE = "white"


class Emotion(StrEnum):
    """Emotion that a face shows."""

    NEUTRAL = "neutral"
    HAPPY = "happy"
    SAD = "sad"
    ANGRY = "angry"
    SURPRISED = "surprised"
    AFRAID = "afraid"


class Gesture(StrEnum):
    """Hand gestures of people; left and right are the person's own."""

    PULL = "pull"  # a hand, or two fingers, pulled towards the body
    PUSH = "push"
    UP = "up"
    DOWN = "down"
    LEFT = "left"
    RIGHT = "right"
    STOP = "stop"  # the flat hand held up
    THUMB_UP = "thumb_up"
    THUMB_DOWN = "thumb_down"
    OPEN = "open"  # fingers spread to zoom in
    CLOSE = "close"
    V = "v"  # two fingers up
    V_DOWN = "v_down"
    PHOTO = "photo"  # a frame made with both hands


class Sport(StrEnum):
    """Exercises whose repetitions can be counted; a plank is timed."""

    SQUAT = "squat"
    HIGH_KNEES = "high_knees"
    SIT_UP = "sit_up"
    PUSH_UP = "push_up"
    PLANK = "plank"
    JUMPING_JACK = "jumping_jack"


class TagKind(StrEnum):
    """Kind of a printed code: an AprilTag carries a number, a QR code a text."""

    APRIL = "april"
    QR = "qr"


@dataclass(frozen=True, slots=True)
class PersonSeen:
    """``number``: this robot's own for that person, the same whenever it sees them again. ``distance``: m."""

    box: Box
    number: int
    distance: float
    place: Point


@dataclass(frozen=True, slots=True)
class FaceSeen:
    """``print``: the recogniser's faceprint; stored with a member, it identifies the face later.

    ``name``: the member's with the same print; empty for a stranger. ``age`` in years.
    """

    box: Box
    number: int
    print: bytes
    name: str
    age: float
    emotion: Emotion
    distance: float


@dataclass(frozen=True, slots=True)
class GestureSeen:
    """A gesture seen; ``number`` of the person as in PersonSeen; ``box`` holds the whole person."""

    box: Box
    gesture: Gesture
    number: int


@dataclass(frozen=True, slots=True)
class Joint:
    """A place in the picture (may lie outside it), and whether it can be seen."""

    x: float
    y: float
    visible: bool


@dataclass(frozen=True, slots=True)
class SkeletonSeen:
    """``joints`` in the order of JOINTS; ``aspect``: the picture's width by its height."""

    box: Box
    number: int
    joints: tuple[Joint, ...]
    aspect: float


@dataclass(frozen=True, slots=True)
class MarkerSeen:
    """A visual marker: "0" to "9", "A" to "Z", "heart", "stop", "left", "right", "forward" ...; ``distance``: m."""

    symbol: str
    colour: Colour
    box: Box
    distance: float


@dataclass(frozen=True, slots=True)
class LinePoint:
    """A point of a line in the picture.

    ``angle``: the line's direction there, rad, 0 up in the picture, positive to the right. ``curvature``: of the line
    on the floor, 1/m, positive to the left; 0 is straight.
    """

    x: float
    y: float
    angle: float
    curvature: float


@dataclass(frozen=True, slots=True)
class LineSeen:
    """A line on the floor: LINE_POINTS points at equal ways along it, the nearest first."""

    colour: Colour
    points: tuple[LinePoint, ...]


@dataclass(frozen=True, slots=True)
class RobotSeen:
    """Another robot; ``distance`` in m from the camera."""

    box: Box
    distance: float
    place: Point


@dataclass(frozen=True, slots=True)
class TagSeen:
    """``pose``: the tag's place, +x out of the paper, in base_link; ``height``: of its middle above base_link, m.

    ``text`` is the number in digits for an APRIL tag.
    """

    kind: TagKind
    text: str
    box: Box
    pose: Pose
    height: float


@dataclass(frozen=True, slots=True)
class ReflectorSeen:
    """A strip that throws the lidar's light back; all strips look the same."""

    place: Point
    distance: float


@dataclass(frozen=True, slots=True)
class Sighting(Generic[T]):
    """All of a kind that one picture (or scan) shows, nearest first. ``stamp``: when that was taken, s."""

    stamp: float
    seen: tuple[T, ...]


@dataclass(frozen=True, slots=True)
class ClapsHeard:
    """``count`` claps shortly after one another, the last one at ``stamp``."""

    stamp: float
    count: int


@dataclass(frozen=True, slots=True)
class SpeechHeard:
    """An utterance that ended at ``stamp`` and took ``seconds``; ``text`` is empty if it was too faint.

    ``print`` and ``name``: the voice, as in FaceSeen; ``loudness``: dB below a microphone's full scale.
    """

    stamp: float
    seconds: float
    text: str
    print: bytes
    name: str
    loudness: float
