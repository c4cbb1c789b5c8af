"""Gives a robot the skills that its parts allow, and starts them. Knows no algorithm."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable
from time import perf_counter
from typing import TYPE_CHECKING

from roboglot.autonomy.building.floors import LiftFloors
from roboglot.autonomy.delivery.industry import CallBook
from roboglot.autonomy.delivery.service import QueueDelivery
from roboglot.autonomy.docking.docking import RearDocking
from roboglot.autonomy.docking.shelf_legs import CarriedLegs
from roboglot.autonomy.docking.tag_docking import MarkDocking
from roboglot.autonomy.following.following import SightFollowing
from roboglot.autonomy.landmarks.landmark_map import LandmarkKeeper
from roboglot.autonomy.navigation.area_monitor import AreaWatch
from roboglot.autonomy.navigation.context import NavigationContext
from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.autonomy.navigation.navigation import GridNavigation
from roboglot.autonomy.navigation.restricted import RestrictedAreas
from roboglot.autonomy.navigation.sweeping.component import LaneSweeping
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.inertial_displacement import InertialDisplacement
from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.autonomy.slam.mapping import LidarMapping
from roboglot.autonomy.slam.odometry.memory import OdometryMemory
from roboglot.autonomy.stairs.alignment import SeenStairAlignment
from roboglot.autonomy.traffic.traffic import Traffic
from roboglot.autonomy.training import HeardWords
from roboglot.kernels import NAVIGATION, loading
from roboglot.kernels.ahead import KernelsUnavailable, compile_beside, missing
from roboglot.model.background import load
from roboglot.model.clock import RealClock
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.interaction.training_words import TrainingWords
from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.logistics.industry import Industry
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.laser_landmarks import LaserLandmarks
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.storeys import Storeys
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.following import Following
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.motion.stair_alignment import StairAlignment
from roboglot.model.components.motion.sweeping import Sweeping
from roboglot.model.components.motion.tag_docking import TagDocking
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.components.sensing.ultra_wideband import UltraWideband
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import NotReady, Refused, RobotError
from roboglot.model.events import ScanTaken
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.planner import Planner
    from roboglot.autonomy.slam.slam import Slam

log = logging.getLogger(__name__)
UNAVAILABLE = "navigation unavailable"  # the fault raised while there is neither mapping nor navigation


class Autonomy:
    """Adds Driving, and with a Lidar Localization, Mapping, Navigation and Docking, to ``robot``.

    A robot with its own Driving, like some real ones, keeps its own skills.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = self.robot = robot
        self._context: NavigationContext | None = None
        self._docking: RearDocking | None = None
        self._delivery: QueueDelivery | None = None
        self._area_watch: AreaWatch | None = None
        self._landmarks: LandmarkKeeper | None = None
        self._restricted: RestrictedAreas | None = None
        self._carried: CarriedLegs | None = None
        self._floors: LiftFloors | None = None
        self._loading: asyncio.Task[None] | None = None
        self._slam: Slam | None = None
        self._memory: OdometryMemory | None = None
        self._stop_treading: Callable[[], None] = lambda: None
        self._localization: LidarLocalization | None = None
        self._traffic: Traffic | None = None
        self._shoves: InertialDisplacement | None = None
        if Hearing in robot and Settings in robot:
            robot.add(TrainingWords, HeardWords(robot))
        if Base not in robot or Odometry not in robot or Driving in robot:
            return
        driving = OdometryDriving(robot)
        robot.add(Driving, driving)
        if TimeOfFlight in robot and robot[Base].limits.holonomic:
            robot.add(StairAlignment, SeenStairAlignment(robot))
        if Lidar in robot:
            self._add_mapped(robot, driving)
        elif Imu in robot and robot[Imu].averages and Legs not in robot:
            self._shoves = InertialDisplacement(robot)

    def _add_mapped(self, robot: Robot, driving: OdometryDriving) -> None:
        """Add the skills that need a map."""
        if Vision in robot or UltraWideband in robot:
            robot.add(Following, SightFollowing(robot))
        belief = driving.belief = Belief(robot[Odometry])
        self._traffic = Traffic(robot, belief)
        self._context = NavigationContext(robot, belief, self._traffic)
        self._localization = LidarLocalization(robot, belief)
        robot.add(Localization, self._localization)
        robot.add(Mapping, LidarMapping(robot, belief))
        navigation = GridNavigation(robot, self._context)
        robot.add(Navigation, navigation)
        robot.add(TagDocking, MarkDocking(robot, navigation, driving))
        robot.add(Sweeping, LaneSweeping(robot, self._context, navigation))
        if LiftClient in robot:
            self._floors = LiftFloors(robot, self._context, navigation)
            robot.add(Floors, self._floors)
        if Jack in robot:
            self._carried = CarriedLegs(robot, belief, self._context.load)
        if MapAnnotations in robot:
            self._add_annotated(robot, belief)
        if DockContact in robot:
            self._docking = RearDocking(robot, navigation, belief)
            robot.add(Docking, self._docking)
        if Ledger in robot:
            robot.add(Storeys, Storeys())
            self._delivery = QueueDelivery(robot)
            robot.add(Delivery, self._delivery)
            robot.add(Industry, CallBook(robot))

    def _add_annotated(self, robot: Robot, belief: Belief) -> None:
        """Add the skills that need annotations of the map."""
        if Reflectors in robot:
            self._landmarks = LandmarkKeeper(robot, belief)
            robot.add(LaserLandmarks, self._landmarks)
        if TrafficRadio in robot:
            self._restricted = RestrictedAreas(robot, belief)
        if SensorMasks in robot:
            self._area_watch = AreaWatch(robot, belief)

    @property
    def ready(self) -> bool:
        """True once the kernels are loaded; before, localization is odometry, there is no map and navigation waits."""
        return self._slam is not None

    async def start(self, *, wait: bool) -> None:
        """Load the kernels; return at once, or with ``wait`` once all is ready."""
        if self._shoves is not None:
            self._shoves.start()
        if self._context is None:
            return
        if self._loading is None:
            self._loading = asyncio.create_task(
                self._load(self._context, wait=wait), name=f"kernels for {self._robot.id}"
            )
            if self._delivery is not None:
                self._delivery.start()
        if wait:
            await self._loading

    async def close(self) -> None:
        """Stop listening to the robot's events."""
        if self._loading is not None:
            self._loading.cancel()
        self._stop_treading()
        if self._memory is not None:
            with contextlib.suppress(RobotError):  # the disk may be full
                await self._memory.close()
        if self._slam is not None:
            self._slam.close()
        for part in (
            self._floors,
            self._delivery,
            self._docking,
            self._area_watch,
            self._landmarks,
            self._restricted,
            self._traffic,
            self._carried,
            self._shoves,
        ):
            if part is not None:
                part.close()

    async def _load(self, context: NavigationContext, *, wait: bool) -> None:
        """Load the kernels in a thread; compile missing ones first, with progress in the log.

        With ``wait`` there is no fault meanwhile: no time passes, and a lockstep run is the same on every machine.
        """
        begun = perf_counter()
        if lacking := await load(lambda: missing(NAVIGATION)):  # at the first time, it reads the sources
            log.info(
                "robot %s can be driven, seen and programmed; maps, localization and navigation follow when %d kernels"
                " are compiled, once after an installation",
                self._robot.id,
                len(lacking),
            )
            context.unavailable = NotReady("navigation is warming up: its kernels are being compiled")
            if not wait:
                self._report(FaultLevel.WARNING, str(context.unavailable))
        try:
            if lacking:
                await compile_beside(NAVIGATION, _log_progress)
            slam_class, planner_class = await load(_estimator_and_planner)
        except Exception as error:
            reason = str(error) or type(error).__name__
            context.unavailable = Refused(f"no mapping and no navigation: {reason}")
            self._report(FaultLevel.ERROR, str(context.unavailable))
            log.error("robot %s has %s", self._robot.id, context.unavailable)
            log.debug("cannot load the kernels", exc_info=error)
            return
        self._report(None, "")
        context.unavailable = None
        self._slam = slam_class(self._robot, context.belief)
        if Settings in self._robot:
            self._memory = OdometryMemory(self._robot, self._slam)
        if self._localization:
            self._localization.estimator = self._slam
        context.planner = planner = planner_class(context.belief, self._robot.description.radius, context.load)
        self._stop_treading = self._robot.events.listen(ScanTaken, lambda _: planner.tread(context.belief.pose))
        log.info("robot %s can map and navigate (kernels loaded in %.1f s)", self._robot.id, perf_counter() - begun)
        if isinstance(self._robot.clock, RealClock):  # loads the cameras' kernels before a client asks for a picture
            with contextlib.suppress(KernelsUnavailable):
                await compile_beside(report=_log_progress)

    def _report(self, level: FaultLevel | None, message: str) -> None:
        """Set the fault of Health for missing navigation, or clear it (None)."""
        if Health in self._robot:
            health = self._robot[Health]
            health.set(UNAVAILABLE, False, "autonomy", FaultLevel.WARNING)
            if level is not None:
                health.set(UNAVAILABLE, True, "autonomy", level, message)


def _log_progress(name: str, done: int, total: int) -> None:
    log.info("compiled kernel %d of %d: %s", done, total, name)


def _estimator_and_planner() -> tuple[type[Slam], type[Planner]]:
    """Return the two classes that need the compiled kernels."""
    with loading():
        from roboglot.autonomy.navigation.planner import Planner
        from roboglot.autonomy.slam.slam import Slam

    return Slam, Planner
