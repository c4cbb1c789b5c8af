"""The table of the REST door's operations, and what a handler gets to work with.

A handler registers under its contract key ("GET /api/…"). Its parameters come by name from the path and the query;
one named ``body`` is the decoded JSON body, or the bare one if its type is ``bytes``; with a default it may be missing.
What it returns is the answer: None an empty 200 (null where it may be something else), ``NO_CONTENT`` an empty 204,
``bytes`` a binary, a ``Text`` a string that some clients want bare, anything else JSON.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from roboglot.model.robot import Robot
from roboglot.operations import OperationTable
from roboglot.protocols.slamware.chapters.artifact.poi_shifts import PoiShifts
from roboglot.protocols.slamware.chapters.cloud import CloudFolder
from roboglot.protocols.slamware.chapters.delivery.box_log import BoxLog
from roboglot.protocols.slamware.chapters.event_log import EventLog
from roboglot.protocols.slamware.chapters.lifetime_totals import Totals
from roboglot.protocols.slamware.chapters.motion.action_book import ActionBook
from roboglot.protocols.slamware.chapters.motion.speed_limits import SpeedLimits
from roboglot.protocols.slamware.chapters.slam.map_keeper import MapKeeper
from roboglot.protocols.slamware.chapters.system.laser import Laser
from roboglot.protocols.slamware.chapters.updater import Updater

OPERATIONS: OperationTable[str] = OperationTable("slamware")


@dataclass(frozen=True, slots=True)
class Desk:
    """One robot as the handlers see it: the model, and what this door keeps in mind about it."""

    robot: Robot
    actions: ActionBook
    events: EventLog
    laser: Laser
    maps: MapKeeper
    limits: SpeedLimits
    totals: Totals
    updater: Updater
    boxes: BoxLog
    shifts: PoiShifts
    cloud: CloudFolder


@dataclass(frozen=True, slots=True)
class Text:
    """A string that the manual calls text/plain, but which most clients want as a JSON string."""

    value: str


class NoContent(Enum):
    """The answer of what the manual says ends with 204."""

    NO_CONTENT = 204


NO_CONTENT = NoContent.NO_CONTENT
