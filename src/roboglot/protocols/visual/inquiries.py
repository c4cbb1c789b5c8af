"""Frames of type AI and SLAM (0.2.1.1.2.2.3 and following): what the robot knows besides programs."""

from __future__ import annotations

from roboglot.model.components.map_library import MapLibrary
from roboglot.model.errors import RobotError
from roboglot.programs.reports import Refusal
from roboglot.programs.service import ProgramService
from roboglot.programs.tasks import TaskOperation
from roboglot.protocols.visual.answers import Answers
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.requests import Kind, Request

Item = dict[str, object]


async def answer(service: ProgramService, request: Request, answers: Answers) -> None:
    """List the saved maps, or the preset points of the newest; people and words are not built."""
    service.allow(TaskOperation.INQUIRY)
    try:
        match request.kind, request.mode:
            case Kind.SLAM, "map":
                items = await _maps(service.robot[MapLibrary])
            case Kind.SLAM, "preset":
                items = await _presets(service.robot[MapLibrary])
            case _:
                raise Refusal(FeedbackState.OTHER, f"the inquiry of {request.kind} {request.mode} is not built yet")
    except RobotError as error:
        raise Refusal(FeedbackState.OTHER, str(error)) from None
    wanted = [item for item in items if not request.targets or item["id"] in request.targets]
    answers.list(sorted(wanted, key=lambda item: str(item["id"])))


async def _maps(library: MapLibrary) -> list[Item]:
    # The vendor's robots make outdoor maps with cameras; what the lidar made is an indoor one.
    return [
        {"id": name, "mode": "map", "style": "[]", "condition": "indoor", "describe": name}
        for name in await library.names()
    ]


async def _presets(library: MapLibrary) -> list[Item]:
    """The labels on the map saved last: that is the one the robot moves in, as long as nobody loads another."""
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
