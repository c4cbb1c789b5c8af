"""Detectors of visual markers, AprilTags and QR codes."""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.geometry import Pose
from roboglot.model.perception import Box, Colour, MarkerSeen, TagKind, TagSeen
from roboglot.simulation.building.cards import Card
from roboglot.simulation.building.tags import fixed_tags, moving_tags
from roboglot.simulation.detectors.observation import Floats, Observation

SLANT = math.radians(65)  # the steepest angle to a card
CARD_HEIGHT = {"marker": 0.025, TagKind.APRIL: 0.025, TagKind.QR: 0.06}  # smallest share of the picture's height
GRID = 7  # points across a card that must all be visible
ASIDE, UP = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-0.5, 0.5, GRID)]))
TAG_YAW_NOISE = math.radians(0.8)
TAG_HEIGHT_NOISE = 0.003  # m


def see_markers(observation: Observation) -> list[MarkerSeen]:
    """Return the markers, nearest first."""
    found = []
    for marker in observation.around.world.floors[observation.floor].markers:
        card = Card(Pose(*marker.at, math.radians(marker.facing)), marker.height, marker.size)
        box = _box(card, CARD_HEIGHT["marker"], observation)
        if box is not None:
            distance, _ = observation.estimate(_middle(card, observation))
            found.append(MarkerSeen(marker.symbol, Colour(marker.colour), observation.shaken(box), distance))
    return sorted(found, key=lambda marker: marker.distance)


def see_tags(observation: Observation) -> list[TagSeen]:
    """Return the codes on walls, docks and shelves, nearest first."""
    found = []
    around = observation.around
    fixed = fixed_tags(around.world.floors[observation.floor])
    for tag in (*fixed, *moving_tags(around.world, around.props, observation.floor)):
        card = tag.card
        box = _box(card, CARD_HEIGHT[tag.kind], observation)
        if box is None:
            continue
        distance, place = observation.estimate(_middle(card, observation))
        turn, lift = observation.random.standard_normal(2).tolist()
        yaw = card.pose.relative_to(observation.hull.pose).yaw + TAG_YAW_NOISE * turn
        pose = Pose(place.x, place.y, math.remainder(yaw, math.tau))
        height = observation.ground + card.height - observation.hull.elevation + TAG_HEIGHT_NOISE * lift
        found.append((distance, TagSeen(tag.kind, tag.text, observation.shaken(box), pose, height)))
    return [seen for _, seen in sorted(found, key=lambda entry: entry[0])]


def _box(card: Card, least: float, observation: Observation) -> Box | None:
    """Return the card's box in the picture; None: it cannot be read."""
    if observation.bearing_from(card.pose) > SLANT:
        return None
    middle, _ = observation.view.project(_middle(card, observation)[None])
    if not observation.view.inside(middle).all():
        return None
    spots = _spots(card, observation)
    box = observation.view.box(spots)
    if box is None or box.height < least:
        return None
    if not observation.visible(spots).all() or observation.overlooked():
        return None
    return box


def _middle(card: Card, observation: Observation) -> Floats:
    return np.array((card.pose.x, card.pose.y, observation.ground + card.height))


def _spots(card: Card, observation: Observation) -> Floats:
    """Return a grid of points over the card, dense enough to notice table legs before it (world)."""
    aside, up = ASIDE * card.size, UP * card.size
    x = card.pose.x - math.sin(card.pose.yaw) * aside
    y = card.pose.y + math.cos(card.pose.yaw) * aside
    return np.column_stack((x, y, observation.ground + card.height + up))
