"""Poses of printed codes: fixed on walls, moving with docks and shelves, and hung up through the stage."""

from __future__ import annotations

import math
from collections.abc import Iterator

from roboglot.model.geometry import Pose
from roboglot.model.perception import TagKind
from roboglot.simulation.building.blueprint import DOCK_DEPTH
from roboglot.simulation.building.cards import Card, PrintedTag
from roboglot.simulation.building.props import SHELF_PARTS, Props
from roboglot.simulation.world.description import Floor, WorldDescription

DOCK_TAG_SIZE, DOCK_TAG_HEIGHT = 0.12, 0.3  # m
SHELF_TAG_SIZE, SHELF_TAG_HEIGHT = 0.16, 0.35


def fixed_tags(floor: Floor) -> Iterator[PrintedTag]:
    """Yield the fixed tags of a floor (world)."""
    for tag in floor.tags:
        yield PrintedTag(tag.kind, tag.text, Card(Pose(*tag.at, math.radians(tag.facing)), tag.height, tag.size))


def moving_tags(world: WorldDescription, props: Props, floor: int) -> Iterator[PrintedTag]:
    """Yield tags on docks' fronts, between shelves' hind legs, and those hung up (world)."""
    yield from (tag for level, tag in props.tags.values() if level == floor)
    for number, storey in enumerate(world.floors):
        for index, dock in enumerate(storey.docks):
            where = props.solids.get(f"dock {number} {index}")
            if dock.tag is not None and where is not None and where[0] == floor:
                front = where[1].pose.compose(Pose(DOCK_DEPTH / 2))
                yield PrintedTag(TagKind.APRIL, str(dock.tag), Card(front, DOCK_TAG_HEIGHT, DOCK_TAG_SIZE))
        for index, shelf in enumerate(storey.shelves):
            where = props.solids.get(f"shelf {number} {index} {SHELF_PARTS - 1}")  # its board
            if shelf.tag is not None and where is not None and where[0] == floor:
                board = where[1]
                back = board.pose.compose(Pose(-shelf.size[0] / 2))
                height = SHELF_TAG_HEIGHT + board.base - shelf.clearance
                yield PrintedTag(TagKind.APRIL, str(shelf.tag), Card(back, height, SHELF_TAG_SIZE))
