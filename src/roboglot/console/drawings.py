"""Annotations of a robot's map, and the true places of things, as plain values."""

from __future__ import annotations

from roboglot.console import plain_values
from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import was_heard
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage

NAMES = ("display_name", "name", "title")  # metadata keys under which doors keep a place's name


def drawings_of(robot: Robot) -> dict[str, object]:
    """Return places, walls, tracks, areas and docks of the map in use."""
    places = robot[Places].all() if Places in robot else ()
    drawn = robot[MapAnnotations].current if MapAnnotations in robot else Annotations()
    return {
        "places": [
            {"id": p.id, "name": name_of(p.id, dict(p.metadata)), "pose": plain_values.pose(p.pose)} for p in places
        ],
        "lines": [{"id": n.id, "kind": str(n.kind), "points": plain_values.points(n.points())} for n in drawn.lines],
        "areas": [{"id": a.id, "kind": str(a.kind), "points": plain_values.points(a.corners())} for a in drawn.areas],
        "docks": [{"id": d.id, "pose": plain_values.pose(d.pose)} for d in drawn.docks],
    }


def name_of(id: str, metadata: dict[str, str]) -> str:
    """Return the name of a place; its id if it has none."""
    return next((metadata[key] for key in NAMES if metadata.get(key)), id)


def plans_of(stage: Stage) -> list[dict[str, object]]:
    """Return the building's floors, in the world's frame."""
    return [
        {
            "number": plan.number,
            "name": plan.name,
            "walls": [plain_values.points(outline) for outline in plan.walls],
            "furniture": [plain_values.points(outline) for outline in plan.furniture],
        }
        for plan in stage.floors
    ]


def truth_of(stage: Stage) -> dict[str, object]:
    """Return the true places of everything, in the world's frame, and the injected faults."""
    return {
        "robots": {r.name: [*plain_values.pose(r.pose), r.floor] for r in stage.robots},
        "people": {p.name: [*plain_values.pose(p.pose), p.floor] for p in stage.people},
        "things": {t.name: [*plain_values.pose(t.pose), t.floor] for t in stage.things},
        "boxes": {str(b.number): [*plain_values.pose(b.pose), b.floor, *b.size[:2]] for b in stage.obstacles},
        "tags": {str(t.number): [*plain_values.pose(t.pose), t.floor, t.text] for t in stage.tags},
        "faults": [
            {"number": f.number, "kind": f.kind, "robot": f.robot, "options": plain_values.plain(dict(f.options))}
            for f in stage.faults
        ],
    }


def anchor_of(robot: Robot, stage: Stage) -> Pose | None:
    """Return the map's pose in the world, assuming a correct pose estimate; None for real robots."""
    true = next((r.pose for r in stage.robots if r.name == robot.id), None)
    believed = whereabouts(robot)
    if true is None or believed is None:
        return None
    return true.compose(believed.inverse())


def whereabouts(robot: Robot) -> Pose | None:
    """Return the robot's estimated pose; None if it has none, or was never connected.

    A robot without localization uses odometry from its start, the origin of its map.
    """
    if not was_heard(robot):
        return None
    if Localization in robot:
        return robot[Localization].pose
    return robot[Odometry].reading.pose if Odometry in robot else None
