"""Localization and map of a Slamware robot. Switches take effect when the robot has confirmed them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.reported import ReportedMapping
from roboglot.drivers.slamware.chapters.motion.actions import ActionRunner, VendorAction
from roboglot.drivers.slamware.state import ReportedState
from roboglot.drivers.slamware.telemetry import TelemetryPoller
from roboglot.drivers.slamware.vocabulary import explored_of, pose3d
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.mapping.localization import LOCALIZATION, Localization, Region
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import ORIGIN, POSITION_MAX, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.wire.slamware import geometry
from roboglot.wire.slamware.chapters.motion import (
    ActionInfo,
    RecoverLocalizationOptions,
    RecoverMovement,
    RelocalizationOptions,
)
from roboglot.wire.slamware.chapters.slam.explore_map import ExploreMap
from roboglot.wire.slamware.chapters.slam.localization import NewOrigin, Switch
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer
from roboglot.wire.slamware.chapters.slam.stcm_layers import grid_layer, is_grid

Replacing = Callable[[], AbstractAsyncContextManager[None]]

CELLS_MAX = 1 << 26


class SlamwareLocalization(Localization):
    """``localization/*`` and RecoverLocalization."""

    def __init__(
        self,
        client: SlamwareClient,
        supervisor: Supervisor,
        telemetry: TelemetryPoller,
        runner: ActionRunner,
        reported: ReportedState,
    ) -> None:
        self._client, self._supervisor, self._telemetry = client, supervisor, telemetry
        self._runner, self._reported = runner, reported

    @property
    def pose(self) -> Pose:
        """Latest reported pose, up to 0.1 s old."""
        return self._reported.pose

    @property
    def quality(self) -> float:
        return self._reported.quality

    @property
    def enabled(self) -> bool:
        return self._reported.localizing

    def enable(self, on: bool) -> None:
        async def switch() -> None:
            await self._client.set_map_localization(Switch(on))
            self._reported.localizing = on

        self._supervisor.send("switching localization", switch())

    def set_pose(self, pose: Pose) -> None:
        if not (math.hypot(pose.x, pose.y) <= POSITION_MAX and math.isfinite(pose.yaw)):
            raise InvalidGoal(f"not a place on this map: {pose}")
        self._supervisor.send("setting the pose", self._client.set_pose(pose3d(pose)))

    def relocalize(self, region: Region | None = None, *, may_move: bool = False, source: str = "") -> Action:
        area = None
        if region is not None:
            width, height = region.max_x - region.min_x, region.max_y - region.min_y
            if not (width > 0 and height > 0):
                raise InvalidGoal(f"not a region of this map: {region}")
            area = geometry.Rectangle(region.min_x, region.min_y, width, height)
        movement = RecoverMovement.ROTATE_ONLY if may_move else RecoverMovement.NO_MOVE
        options = RelocalizationOptions(recover_movement_type=movement)
        return self._runner.start(
            "relocalize",
            VendorAction("RecoverLocalizationAction", RecoverLocalizationOptions(area, options), _nothing),
            goal=region,
            source=source,
            resources=(LOCALIZATION,),
        )


class SlamwareMapping(ReportedMapping):
    """``maps/*``, polled every two seconds."""

    def __init__(
        self,
        client: SlamwareClient,
        supervisor: Supervisor,
        telemetry: TelemetryPoller,
        reported: ReportedState,
        replacing: Replacing,
    ) -> None:
        super().__init__(reported)
        self._client, self._supervisor, self._telemetry, self._reported = client, supervisor, telemetry, reported
        self._replacing = replacing

    @property
    def enabled(self) -> bool:
        return self._reported.mapping

    def enable(self, on: bool) -> None:
        async def switch() -> None:
            await self._client.set_map_update(Switch(on))
            self._reported.mapping = on

        self._supervisor.send("switching mapping", switch())

    @property
    def closes_loops(self) -> bool:
        return self._reported.closes_loops

    def close_loops(self, on: bool) -> None:
        async def switch() -> None:
            await self._client.set_loop_closure(Switch(on))
            self._reported.closes_loops = on

        self._supervisor.send("switching loop closure", switch())

    def clear(self) -> None:
        async def clear() -> None:
            await self._client.clear_map()
            await self._telemetry.read_map()

        self._supervisor.send("clearing the map", clear())

    def load(self, grid: OccupancyGrid, pose: Pose, *, origin: Pose | None = None) -> None:
        if grid.width * grid.height > CELLS_MAX:
            raise InvalidGoal(f"a map has at most {CELLS_MAX} cells")
        if origin not in (None, ORIGIN):
            raise InvalidGoal("this robot takes over its drawings only to a map with the same origin")

        async def load() -> None:
            async with self._replacing():
                drawn = () if origin is None else (await self._client.get_composite_map()).layers
                await self._client.set_composite_map(_with_grid(drawn, explored_of(grid)))
            await self._client.set_pose(pose3d(pose))
            await self._telemetry.read_map(origin)

        self._supervisor.send("loading a map", load())

    def move_origin(self, point: Point) -> Point:
        """Move the origin and return the nearest cell border of the known map."""
        if not math.hypot(point.x, point.y) <= POSITION_MAX:
            raise InvalidGoal(f"too far away: {point}")
        cell = self._reported.grid.resolution

        async def move() -> None:
            await self._client.move_origin_point(NewOrigin(geometry.Point(point.x, point.y)))
            await self._telemetry.read_map()

        self._supervisor.send("moving the origin", move())
        return Point(round(point.x / cell) * cell, round(point.y / cell) * cell)


def _with_grid(layers: Sequence[Layer], grid: ExploreMap) -> CompositeMap:
    """Return a map with these layers but another grid, which keeps the name of its floor."""
    old = [layer for layer in layers if is_grid(layer)]
    new = grid_layer(grid)
    named = tuple(pair for layer in old[:1] for pair in layer.pairs if pair[0] not in new.metadata)
    return CompositeMap((grid_layer(grid, named), *(layer for layer in layers if not is_grid(layer))))


async def _nothing(_: ActionInfo) -> None:
    return None
