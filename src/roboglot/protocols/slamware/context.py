"""First argument of every handler of the REST door."""

from __future__ import annotations

from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.artifact.poi_shifts import PoiShifts
from roboglot.protocols.slamware.chapters.cloud import CloudFolder
from roboglot.protocols.slamware.chapters.delivery.box_log import BoxLog
from roboglot.protocols.slamware.chapters.firmware.updater import Updater
from roboglot.protocols.slamware.chapters.motion.action_book import ActionBook
from roboglot.protocols.slamware.chapters.motion.speed_limits import SpeedLimits
from roboglot.protocols.slamware.chapters.platform.event_log import EventLog
from roboglot.protocols.slamware.chapters.slam.map_keeper import MapKeeper
from roboglot.protocols.slamware.chapters.statistics.lifetime_totals import Totals
from roboglot.protocols.slamware.chapters.system.laser import Laser
from roboglot.protocols.slamware.chapters.system.masks import Masks
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Context:
    """Context of one robot: the model, and the state of this door while it is open."""

    robot: Robot
    actions: ActionBook
    events: EventLog
    laser: Laser
    maps: MapKeeper
    limits: SpeedLimits
    masks: Masks
    totals: Totals
    updater: Updater
    boxes: BoxLog
    shifts: PoiShifts
    cloud: CloudFolder
