"""Chapter 6.2.3: finding objects, driving precisely to a mark, and the robot's log."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal, TagDocking
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.system_log import SystemLog
from roboglot.model.errors import NotFound
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import SOURCE, Context
from roboglot.protocols.vda5050.table import TABLE
from roboglot.wire.vda5050.orders import Text

LOOKING = 3.0  # s of robot time for an object to appear in the picture
LOOK = 0.1
REPORTS = "vda5050/log-"  # prefix of report names
REPORTS_MAX = 10


class Thing(StrEnum):
    """Objects that the robot's camera recognises."""

    PERSON = "person"
    FACE = "face"
    ROBOT = "robot"
    TAG = "tag"
    MARKER = "marker"


# Fields of the result that describe the nearest one, after the object's name.
_WORDS: dict[Thing, Callable[[Any], str]] = {
    Thing.PERSON: lambda seen: f"{seen.distance:.2f} m away",
    Thing.FACE: lambda seen: f"{seen.name or 'unknown'}, {seen.distance:.2f} m away",
    Thing.ROBOT: lambda seen: f"{seen.distance:.2f} m away",
    Thing.TAG: lambda seen: f"{seen.text} at {seen.pose.x:z.2f} {seen.pose.y:z.2f}",
    Thing.MARKER: lambda seen: f"{seen.symbol}, {seen.distance:.2f} m away",
}


def _detectors(vision: Vision) -> dict[Thing, Detector[Any]]:
    return {
        Thing.PERSON: vision.people,
        Thing.FACE: vision.faces,
        Thing.ROBOT: vision.robots,
        Thing.TAG: vision.tags,
        Thing.MARKER: vision.markers,
    }


@TABLE.on("detectObject", right=Right.DRIVE, needs=(Vision,))
async def detect_object(context: Context, *, objectType: Thing = Thing.TAG) -> str:  # noqa: N803 - the standard's word
    """Look for an object ahead: person, face, robot, tag or marker; the result says which one and where."""
    clock = context.robot.clock
    detector = _detectors(context.robot[Vision])[objectType]
    with detector.subscribe():
        end = clock.time() + LOOKING
        async for now in clock.every(LOOK):
            sighting = detector.latest
            if sighting is not None and sighting.seen:
                return f"{objectType} {_WORDS[objectType](sighting.seen[0])}"
            if now >= end:
                break
    raise NotFound(f"no {objectType} is in sight")


@TABLE.on("finePositioning", right=Right.DRIVE, needs=(TagDocking, Localization))
async def fine_positioning(
    context: Context,
    *,
    stationType: Mark = Mark.PRINTED,  # noqa: N803
    stationName: Text = "",  # noqa: N803
) -> str:
    """Drive precisely before a mark ahead: printed (stationName: its text), board, reflectors or shelf."""
    robot = context.robot
    texts = frozenset({stationName}) if stationName and stationType is Mark.PRINTED else frozenset[str]()
    goal = MarkGoal(mark=stationType, start=robot[Localization].pose, texts=texts)
    await context.performer.carry_out(robot[TagDocking].dock_at(goal, source=SOURCE))
    pose = robot[Localization].pose
    return f"at {pose.x:z.3f} {pose.y:z.3f} {pose.yaw:z.3f}"


@TABLE.on("logReport", right=Right.EDIT, needs=(SystemLog, FileStore))
async def report_log(context: Context, *, reason: Text) -> str:
    """Keep the robot's log as a file, with the reason above it; the result is its name."""
    robot = context.robot
    now = datetime.fromtimestamp(robot.clock.epoch(), UTC)
    name = f"{REPORTS}{now:%Y%m%dT%H%M%S%f}.txt"
    lines = [f"robot {robot.id}, {now.isoformat()}: {reason}", *robot[SystemLog].lines]
    await robot[FileStore].write(name, "\n".join(lines).encode())
    kept = sorted(known for known in await robot[FileStore].names() if known.startswith(REPORTS))
    for old in kept[:-REPORTS_MAX]:
        with suppress(NotFound):  # another report removes them, too
            await robot[FileStore].remove(old)
    return name
