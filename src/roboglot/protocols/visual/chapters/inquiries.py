"""Frames of type AI and SLAM (0.2.1.1.2.2.3 and following): what the robot knows besides programs."""

from __future__ import annotations

from collections.abc import Iterable

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.programs.functions.senses.people import known_words
from roboglot.programs.tasks.robot_modes import check_mode
from roboglot.programs.tasks.states import TaskOperation
from roboglot.protocols.visual.context import Context
from roboglot.protocols.visual.table import TABLE
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.requests import FrameSubject, Request

Item = dict[str, str]


@TABLE.on(
    "AI all",
    "AI personnel",
    "AI face",
    "AI voiceprint",
    "AI training_words",
    "SLAM map",
    "SLAM preset",
    right=Right.SEE,
)
async def inquire(context: Context) -> None:
    """List the saved maps, the preset points of the newest, the robot's members, or the words it listens for."""
    request = context.request
    check_mode(context.service.robot, TaskOperation.INQUIRY)
    try:
        items = await _items(context.robot, request)
    except RobotError as error:
        context.answers.refuse(FeedbackState.OTHER, str(error))
        return
    context.answers.list([item for item in items if not request.targets or item["id"] in request.targets])


async def _items(robot: Robot, request: Request) -> list[Item]:
    """Return the entries of the requested kind, by id, ascending. Raises RobotError."""
    match request.kind, request.mode:
        case FrameSubject.SLAM, "map":
            return _sorted(await _maps(robot[MapLibrary]))
        case FrameSubject.SLAM, _:
            return _sorted(await _presets(robot[MapLibrary]))
        case _, "training_words":
            return _words(robot)
        case _, "all":
            return _people(robot[Members], "personnel") + _words(robot)
        case _, kind:
            return _people(robot[Members], kind)


def _people(members: Members, kind: str) -> list[Item]:
    """Return people; ``kind``: personnel (all members), face or voiceprint (members with one).

    A style or condition of 2 (being enrolled) never occurs: enrolment is not observed.
    """
    people = [
        {
            "id": str(member.id),
            "mode": kind,
            "style": "0" if member.face is None else "1",
            "condition": "0" if member.voice is None else "1",
            "describe": member.name,
        }
        for member in sorted(members.all(), key=lambda member: member.id)
    ]
    entered = {"face": "style", "voiceprint": "condition"}.get(kind)
    return [person for person in people if entered is None or person[entered] == "1"]


def _words(robot: Robot) -> list[Item]:
    return _sorted(
        {"id": w.trigger, "mode": "training_words", "style": w.kind, "condition": w.value, "describe": w.trigger}
        for w in known_words(robot)
    )


def _sorted(items: Iterable[Item]) -> list[Item]:
    return sorted(items, key=lambda item: item["id"])


async def _maps(library: MapLibrary) -> list[Item]:
    outdoors = set(await library.names(outdoor=True))
    return [
        {
            "id": name,
            "mode": "map",
            "style": "[]",
            "condition": "outdoor" if name in outdoors else "indoor",
            "describe": name,
        }
        for name in await library.names()
    ]


async def _presets(library: MapLibrary) -> list[Item]:
    """Return the labels of the map saved last, which the robot uses unless another one is loaded."""
    names = await library.names()
    if not names:
        return []
    newest = await library.get(names[-1])
    return [
        {
            "id": label.name,
            "mode": "preset",
            "style": f"[{label.point.x:.6f}, {label.point.y:.6f}, 0.000000]",
            "condition": newest.name,
            "describe": label.name,
        }
        for label in newest.labels
    ]
