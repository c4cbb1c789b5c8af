"""Visual markers, AprilTags and QR codes, as a camera's detectors make them out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Box, Colour, MarkerSeen, TagKind, TagSeen
from roboglot.simulation.detectors.glance import Floats, Glance
from roboglot.simulation.shelves import ShelfStand

SLANT = math.radians(65)  # how far a card may be turned away
CARD_HEIGHT = {"marker": 0.025, TagKind.APRIL: 0.025, TagKind.QR: 0.06}  # the least of the picture's height
TAG_YAW_NOISE = math.radians(0.8)
TAG_HEIGHT_NOISE = 0.003  # m
DOCK_TAG_SIZE, DOCK_TAG_HEIGHT = 0.12, 0.3  # m
SHELF_TAG_SIZE, SHELF_TAG_HEIGHT = 0.16, 0.35


@dataclass(frozen=True, slots=True)
class Card:
    """A flat square: ``pose`` in world, +x out of it; the ``height`` of its middle above the floor, m."""

    pose: Pose
    height: float
    size: float


def see_markers(glance: Glance) -> list[MarkerSeen]:
    """Markers, nearest first."""
    found = []
    for marker in glance.around.world.floors[glance.floor].markers:
        card = Card(Pose(*marker.at, math.radians(marker.facing)), marker.height, marker.size)
        box = _box(card, CARD_HEIGHT["marker"], glance)
        if box is not None:
            distance, _ = glance.estimate(_middle(card, glance))
            found.append(MarkerSeen(marker.symbol, Colour(marker.colour), glance.shaken(box), distance))
    return sorted(found, key=lambda marker: marker.distance)


def see_tags(glance: Glance) -> list[TagSeen]:
    """Codes on walls, docks and shelves, nearest first."""
    found = []
    for kind, text, card in tags_on(glance):
        box = _box(card, CARD_HEIGHT[kind], glance)
        if box is None:
            continue
        distance, place = glance.estimate(_middle(card, glance))
        turn, lift = glance.random.standard_normal(2).tolist()
        yaw = card.pose.relative_to(glance.hull.pose).yaw + TAG_YAW_NOISE * turn
        pose = Pose(place.x, place.y, math.remainder(yaw, math.tau))
        height = glance.ground + card.height - glance.hull.elevation + TAG_HEIGHT_NOISE * lift
        found.append((distance, TagSeen(kind, text, glance.shaken(box), pose, height)))
    return [tag for _, tag in sorted(found, key=lambda entry: entry[0])]


def tags_on(glance: Glance) -> Iterator[tuple[TagKind, str, Card]]:
    """All codes on the robot's floor, where they are now."""
    floor, building = glance.around.world.floors[glance.floor], glance.around.building
    for tag in floor.tags:
        yield tag.kind, tag.text, Card(Pose(*tag.at, math.radians(tag.facing)), tag.height, tag.size)
    for dock, front in zip(floor.docks, building.docks[glance.floor], strict=True):
        if dock.tag is not None:
            yield TagKind.APRIL, str(dock.tag), Card(front, DOCK_TAG_HEIGHT, DOCK_TAG_SIZE)
    for stand in building.shelves:
        if stand.floor == glance.floor and stand.shelf.tag is not None:
            yield TagKind.APRIL, str(stand.shelf.tag), shelf_card(stand)


def shelf_card(stand: ShelfStand) -> Card:
    """The plate between a shelf's hind legs."""
    back = stand.pose.compose(Pose(-stand.shelf.size[0] / 2))
    return Card(back, SHELF_TAG_HEIGHT + stand.lifted, SHELF_TAG_SIZE)


def _box(card: Card, least: float, glance: Glance) -> Box | None:
    """Where it appears, if it can be read."""
    if glance.bearing_from(card.pose) > SLANT:
        return None
    corners = _corners(card, glance)
    box = glance.view.box(corners)
    if box is None or box.height < least:
        return None
    middle = _middle(card, glance)
    whole = np.concatenate((corners, middle[None]))
    if not glance.visible(whole).all() or glance.overlooked():
        return None
    return box


def _middle(card: Card, glance: Glance) -> Floats:
    return np.array((card.pose.x, card.pose.y, glance.ground + card.height))


def _corners(card: Card, glance: Glance) -> Floats:
    half = card.size / 2
    sides: list[Point] = [card.pose.compose(Pose(0.0, side * half)).point for side in (-1, 1)]
    return np.array([(p.x, p.y, glance.ground + card.height + up * half) for p in sides for up in (-1, 1)])
