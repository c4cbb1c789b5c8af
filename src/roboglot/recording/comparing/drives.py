"""Compares what two recorded robots did: the places they passed while they moved, and the actions they carried out.

Messages alone do not show that: a robot driven from the console may send none. Times count from the first motion, since
recordings begin at any moment before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from difflib import SequenceMatcher
from operator import itemgetter
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf import FrameTransforms_pb2, PoseInFrame_pb2
from google.protobuf.message import DecodeError

from roboglot.model.events import FloorReached
from roboglot.model.geometry import Pose
from roboglot.recording.comparing.comparison import MISSING, Row
from roboglot.recording.comparing.masks import Mask
from roboglot.recording.reader import BadRecording, Record, read_messages
from roboglot.values import dataclass

SECTION = "drive"
TRUTH, POSES, ODOMETRY = "ground truth", "estimated poses", "odometry"
STEP = 0.1  # s between two moments
SPAN_MAX = 7 * 86400.0  # s from the first place to the last: more has a wrong time in it
SHIFTS = 21  # moments tried within the tolerance of time, at either side
AROUND = 0.25  # s before and after a moment that are compared to tell whether the robot moves
STILL = 0.01, np.radians(1.0)  # m, rad: less motion than this within them is standing
SET_OFF = 0.05, np.radians(5.0)  # m, rad from the first place at which the robot has set off


class Track:
    """Places of one robot by time: s, m, m, rad."""

    def __init__(self, places: Sequence[tuple[float, Pose]]) -> None:
        self._times = np.array([at for at, _ in places])
        self._places = np.array([(p.x, p.y) for _, p in places]).T
        self._yaws = np.unwrap([p.yaw for _, p in places])
        self.count = len(places)
        apart, turned = self._far(self._times, self._times[:1])
        moved = (apart > SET_OFF[0]) | (turned > SET_OFF[1])
        self.began = float(self._times[moved.argmax()])  # the first place if it never moved
        self._times = self._times - self.began

    @property
    def span(self) -> tuple[float, float]:
        """First and last time, s since the robot set off."""
        return float(self._times[0]), float(self._times[-1])

    @property
    def driven(self) -> float:
        """Distance driven, m; motion below ``STILL`` is left out as noise."""
        x, y, _ = self.at(np.arange(self.span[0], self.span[1] + STEP, 2 * AROUND))
        steps = np.hypot(np.diff(x), np.diff(y))
        return float(steps[steps > STILL[0]].sum())

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return x, y (m) and yaw (rad) at ``times`` (s); outside of the track, those of its first or last place."""
        x, y = (np.interp(times, self._times, values) for values in self._places)
        return x, y, np.interp(times, self._times, self._yaws)

    def moves(self, times: np.ndarray) -> np.ndarray:
        """Return a mask of the ``times`` (s) at which the robot moved."""
        apart, turned = self._far(times - AROUND, times + AROUND)
        return np.asarray((apart > STILL[0]) | (turned > STILL[1]))

    def text(self, time: float) -> str:
        """Return the place at one time."""
        x, y, yaw = (float(value) for value in self.at(np.array(time)))
        return f"{x:.2f}, {y:.2f} at {np.degrees(_turn(yaw)):.0f}°"

    def _far(self, times: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return far(self.at(times), self.at(others))


Places = tuple[np.ndarray, np.ndarray, np.ndarray]


def far(one: Places, other: Places) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances and the angles between places."""
    return np.hypot(one[0] - other[0], one[1] - other[1]), np.abs(_turn(one[2] - other[2]))


def _turn(angle: np.ndarray | float) -> np.ndarray:
    return np.asarray((np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi)


@dataclass(slots=True)
class Drive:
    """Deeds of one robot: its tracks by source, and in order its actions with their last status, and its floors."""

    tracks: dict[str, Track] = field(default_factory=dict)
    actions: list[tuple[str, str]] = field(default_factory=list)
    floors: list[int] = field(default_factory=list)


def read_drive(path: Path, robot: str) -> Drive:
    """Read what a robot did. Raises BadRecording, OSError."""
    places: dict[str, list[tuple[float, Pose]]] = {TRUTH: [], POSES: [], ODOMETRY: []}
    actions: dict[int, tuple[str, str]] = {}
    floors: list[int] = []
    topics = {f"/truth/{robot}/pose": TRUTH, f"/{robot}/pose": POSES}
    try:
        for record in read_messages(path, *topics, "/tf", f"/{robot}/actions", f"/{robot}/events"):
            if record.schema == "roboglot.Action":
                value = record.json()
                actions[value["id"]] = str(value["name"]), str(value["status"])
            elif record.schema == "roboglot.Event":
                if (value := record.json())["event"] == FloorReached.__name__:
                    floors.append(int(value["floor"]))
            elif (pose := _pose(record, robot)) is not None:
                places[topics.get(record.topic, ODOMETRY)].append((record.at / 1e9, pose))
    except (DecodeError, ValueError, KeyError, TypeError) as error:
        raise BadRecording(f"{path} has a message that cannot be read: {error}") from None
    for source, found in places.items():
        found.sort(key=itemgetter(0))
        if found and (span := found[-1][0] - found[0][0]) > SPAN_MAX:
            days = f"{span / 86400:.0f} days apart (at most {SPAN_MAX / 86400:.0f})"
            raise BadRecording(f"{path}: its {source} are {days}: one of their times is wrong")
    return Drive({source: Track(found) for source, found in places.items() if found}, list(actions.values()), floors)


def _pose(record: Record, robot: str) -> Pose | None:
    if record.schema == "foxglove.PoseInFrame":
        pose = PoseInFrame_pb2.PoseInFrame.FromString(record.data).pose
        return _flat(pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w)
    if record.schema != "foxglove.FrameTransforms":
        return None
    for one in FrameTransforms_pb2.FrameTransforms.FromString(record.data).transforms:
        if (one.parent_frame_id, one.child_frame_id) == (f"{robot}/odom", f"{robot}/base_link"):
            return _flat(one.translation.x, one.translation.y, one.rotation.z, one.rotation.w)
    return None


def _flat(x: float, y: float, z: float, w: float) -> Pose:
    if not np.isfinite((x, y, z, w)).all():
        raise ValueError("a place is not finite")
    return Pose(x, y, float(2 * np.arctan2(z, w)))


@dataclass(slots=True)
class Outcome:
    """Rows of a comparison of two drives; ``figures``: what was compared, in words; ``reason``: why places were not."""

    rows: list[Row]
    figures: str = ""
    reason: str = ""


def compare_drives(one: Drive, other: Drive, mask: Mask, names: tuple[str, str]) -> Outcome:
    """Compare two drives by the best source that both have; ``names``: of the recordings."""
    rows = [_paired("actions", *([" ".join(action) for action in drive.actions] for drive in (one, other)))]
    rows += [_paired("floors", *([str(floor) for floor in drive.floors] for drive in (one, other)))]
    rows = [row for row in rows if row.ones or row.others]
    for source in (TRUTH, POSES, ODOMETRY):
        if source in one.tracks and source in other.tracks:
            row, figures = _compared_places(source, one.tracks[source], other.tracks[source], mask)
            return Outcome([row, *rows], figures)
    without = [name for name, drive in zip(names, (one, other), strict=True) if not drive.tracks]
    reason = f"no places are in {' and '.join(without)}" if without else "places come from different sources"
    return Outcome(rows, reason=reason)


def _compared_places(source: str, one: Track, other: Track, mask: Mask) -> tuple[Row, str]:
    row = Row(SECTION, f"places ({source})", one.count, other.count)
    start, end = min(one.span[0], other.span[0]), max(one.span[1], other.span[1])
    times = np.append(np.arange(start, end, STEP), end)
    moving = one.moves(times) | other.moves(times)
    seconds = STEP * int(moving.sum())
    moving[[0, -1]] = True  # the first and the last place count in any case
    times = times[moving]
    good, apart = _near(one, other, times, mask)
    back_good, back_apart = _near(other, one, times, mask)
    good, apart = good & back_good, np.maximum(apart, back_apart)
    row.checks, row.agreed = len(times), int(good.sum())
    if row.agreed < row.checks:
        worst = float(times[np.where(good, -1.0, apart).argmax()])
        row.note(f"farthest apart, {worst:.1f} s after setting off", one.text(worst), other.text(worst))
    row.check(bool(good[0]), "first place", one.text(times[0]), other.text(times[0]))
    row.check(bool(good[-1]), "last place", one.text(times[-1]), other.text(times[-1]))
    ways = one.driven, other.driven
    figures = (
        f"{source}: at most {apart.max():.2f} m apart in {seconds:.1f} s of motion,"
        f" {ways[0]:.2f} and {ways[1]:.2f} m driven"
    )
    return row, figures


def _near(one: Track, other: Track, times: np.ndarray, mask: Mask) -> tuple[np.ndarray, np.ndarray]:
    """Return at which ``times`` (s) the other robot is at the same place, and the least distance between both (m).

    The other one may be there earlier or later, within the mask's tolerance of time.
    """
    shifts = np.linspace(-mask.seconds, mask.seconds, SHIFTS)
    x, y, yaw = one.at(times)
    apart, turned = far((x[:, None], y[:, None], yaw[:, None]), other.at(times[:, None] + shifts))
    good = (apart <= mask.metres) & (turned <= np.radians(mask.degrees))
    return good.any(axis=1), apart.min(axis=1)


def _paired(what: str, ones: Sequence[str], others: Sequence[str]) -> Row:
    """Pair equal actions, or floors reached, in their order; the others are differences."""
    row = Row(SECTION, what, len(ones), len(others))
    for match, start, end, first, last in SequenceMatcher(None, ones, others, autojunk=False).get_opcodes():
        mine, theirs = ones[start:end], others[first:last]
        for number in range(max(len(mine), len(theirs))):
            a, b = (side[number] if number < len(side) else MISSING for side in (mine, theirs))
            row.check(match == "equal", f"{what.removesuffix('s')} {start + number + 1}", a, b)
    return row
