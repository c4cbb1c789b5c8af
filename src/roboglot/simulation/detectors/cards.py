"""Detectors of visual markers, AprilTags and QR codes."""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.geometry import Pose
from roboglot.model.perception import Box, Colour, MarkerSeen, TagKind, TagSeen
from roboglot.simulation.building.cards import Card
from roboglot.simulation.building.tags import fixed_tags, moving_tags
from roboglot.simulation.detectors.glance import Floats, Glance

SLANT = math.radians(65)  # the steepest angle to a card
CARD_HEIGHT = {"marker": 0.025, TagKind.APRIL: 0.025, TagKind.QR: 0.06}  # smallest share of the picture's height
GRID = 7  # points across a card that must all be visible
ASIDE, UP = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-0.5, 0.5, GRID)]))
TAG_YAW_NOISE = math.radians(0.8)
TAG_HEIGHT_NOISE = 0.003  # m


def see_markers(glance: Glance) -> list[MarkerSeen]:
    """Return the markers, nearest first."""
    found = []
    for marker in glance.around.world.floors[glance.floor].markers:
        card = Card(Pose(*marker.at, math.radians(marker.facing)), marker.height, marker.size)
        box = _box(card, CARD_HEIGHT["marker"], glance)
        if box is not None:
            distance, _ = glance.estimate(_middle(card, glance))
            found.append(MarkerSeen(marker.symbol, Colour(marker.colour), glance.shaken(box), distance))
    return sorted(found, key=lambda marker: marker.distance)


def see_tags(glance: Glance) -> list[TagSeen]:
    """Return the codes on walls, docks and shelves, nearest first."""
    found = []
    around = glance.around
    fixed = fixed_tags(around.world.floors[glance.floor])
    for tag in (*fixed, *moving_tags(around.world, around.props, glance.floor)):
        card = tag.card
        box = _box(card, CARD_HEIGHT[tag.kind], glance)
        if box is None:
            continue
        distance, place = glance.estimate(_middle(card, glance))
        turn, lift = glance.random.standard_normal(2).tolist()
        yaw = card.pose.relative_to(glance.hull.pose).yaw + TAG_YAW_NOISE * turn
        pose = Pose(place.x, place.y, math.remainder(yaw, math.tau))
        height = glance.ground + card.height - glance.hull.elevation + TAG_HEIGHT_NOISE * lift
        found.append((distance, TagSeen(tag.kind, tag.text, glance.shaken(box), pose, height)))
    return [seen for _, seen in sorted(found, key=lambda entry: entry[0])]


def _box(card: Card, least: float, glance: Glance) -> Box | None:
    """Return the card's box in the picture; None: it cannot be read."""
    if glance.bearing_from(card.pose) > SLANT:
        return None
    middle, _ = glance.view.project(_middle(card, glance)[None])
    if not glance.view.inside(middle).all():
        return None
    spots = _spots(card, glance)
    box = glance.view.box(spots)
    if box is None or box.height < least:
        return None
    if not glance.visible(spots).all() or glance.overlooked():
        return None
    return box


def _middle(card: Card, glance: Glance) -> Floats:
    return np.array((card.pose.x, card.pose.y, glance.ground + card.height))


def _spots(card: Card, glance: Glance) -> Floats:
    """Return a grid of points over the card, dense enough to notice table legs before it (world)."""
    aside, up = ASIDE * card.size, UP * card.size
    x = card.pose.x - math.sin(card.pose.yaw) * aside
    y = card.pose.y + math.cos(card.pose.yaw) * aside
    return np.column_stack((x, y, glance.ground + card.height + up))
