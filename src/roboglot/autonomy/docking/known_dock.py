"""Known pose of the dock on the map, and the robot's pose by the dock's contacts. Moves nothing.

A known dock localizes a lost robot; after a pose given by hand, no dock is learned until scans confirm the pose.
"""

from __future__ import annotations

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.events import (
    DockContactChanged,
    LocalizationLost,
    LoopClosed,
    MapReplaced,
    PoseConfirmed,
    PoseJumped,
    Rebooted,
)
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.robot import Robot

BESIDE = 0.5  # m from the known dock within which a contact is attributed to it: the map may be a little off


class KnownDock:
    """Dock known from the first contact, or set by ``put``."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        docked = robot[DockContact].docked
        self._pose: Pose | None = ORIGIN if docked else None
        self._on_it = docked  # whether the contacts touch this dock rather than another
        self._confirmed = True  # whether scans have confirmed the last pose that was set
        self._anchored = False  # whether the robot's place was announced since the pose was last set
        listen = robot.events.listen
        self._listeners = [
            listen(DockContactChanged, self._touched),
            listen(MapReplaced, self._moved),
            listen(LoopClosed, self._straightened),
            listen(PoseJumped, self._jumped),
            listen(PoseConfirmed, lambda _: self._confirm()),
            listen(LocalizationLost, lambda _: self._anchor()),
            listen(Rebooted, self._begin),
        ]

    def close(self) -> None:
        """Stop listening."""
        for stop in self._listeners:
            stop()

    @property
    def pose(self) -> Pose | None:
        """Pose of the docked base_link in map (m, rad); None if no dock is known."""
        return self._pose

    def put(self, pose: Pose | None) -> None:
        """Set the dock's pose; None: there is none."""
        self._pose = pose
        self._on_it = pose is not None and self._robot[DockContact].docked and self._is_near(pose)

    def _is_near(self, pose: Pose) -> bool:
        localization = self._robot[Localization]
        return localization.lost is not None or localization.pose.distance_to(pose) <= BESIDE

    def _touched(self, event: DockContactChanged) -> None:
        self._anchored = False
        self._on_it = event.docked and self._pose is not None and self._is_near(self._pose)
        if event.docked:
            self._learn()
        if self._robot[Localization].lost is not None:
            self._anchor()

    def _learn(self) -> None:
        """Learn the dock's pose from a localized robot that touches it, if none is known yet."""
        localization = self._robot[Localization]
        if self._pose is None and self._confirmed and localization.lost is None and self._robot[DockContact].docked:
            self._pose, self._on_it = localization.pose, True

    def _moved(self, event: MapReplaced) -> None:
        """Transform the dock's pose to the map's new origin; forget it with the map."""
        if self._pose is not None:
            self._pose = None if event.origin is None else self._pose.relative_to(event.origin)
        self._on_it = self._on_it and self._pose is not None
        if event.origin is not None:
            self._learn()

    def _begin(self, _: Rebooted) -> None:
        """Trust the pose, as a new map begins here: ``MapReplaced`` follows."""
        self._confirmed = True

    def _straightened(self, event: LoopClosed) -> None:
        """Move the dock with the nearest corrected pose of a loop closure."""
        if self._pose is not None and event.moved:
            here = self._pose
            was, now = min(event.moved, key=lambda pair: pair[0].distance_to(here))
            self._pose = now.compose(here.relative_to(was))

    def _jumped(self, event: PoseJumped) -> None:
        self._confirmed = not event.given
        if event.given:
            self._anchored = self._anchored and event.pose == self._pose
        self._learn()

    def _confirm(self) -> None:
        self._confirmed = True
        self._learn()

    def _anchor(self) -> None:
        """Set the pose of a lost robot on this dock to the dock's; only once, as the dock may have been moved."""
        if self._on_it and self._pose is not None and not self._anchored:
            self._anchored = True
            self._robot[Localization].set_pose(self._pose)
