"""Chapter "motion", POST actions: relocalization, by itself or while a person pushes the robot."""

from __future__ import annotations

import math

from roboglot.confirmation import confirmed
from roboglot.model.actions import Action
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization, Region
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Expired, NotLocalized
from roboglot.model.geometry import Pose
from roboglot.protocols.slamware.chapters.motion.errands import PART, Errand, run_errand
from roboglot.protocols.slamware.chapters.motion.home_docks import home_dock
from roboglot.protocols.slamware.context import Context
from roboglot.wire.slamware.chapters.motion import (
    NoOptions,
    RecoverLocalizationOptions,
    RecoverMovement,
    RelocalizationOptions,
)

RECOVER_SECONDS = 30.0  # s, unless the client sets a limit
TURN = math.radians(60)  # between two searches
PLACE_SECONDS = 4.0  # s to find a place twice
PAUSE_SECONDS = 0.5  # between two searches from the same place, and while it is being pushed


def recover_localization(context: Context, options: RecoverLocalizationOptions) -> Action:
    """Search the whole map or an area; standing still, unless it may turn between scans."""
    how = options.relocalization_options or RelocalizationOptions()
    seconds = how.max_recover_time / 1000 or RECOVER_SECONDS
    turns = how.recover_movement_type is RecoverMovement.ROTATE_ONLY
    area, region = options.area, None
    if area is not None and area.width > 0 and area.height > 0:
        region = Region(area.x, area.y, area.x + area.width, area.y + area.height)

    async def work(errand: Errand) -> None:
        robot = errand.robot
        deadline = robot.clock.time() + seconds
        while (left := deadline - robot.clock.time()) > 0:
            try:
                await errand.do(robot[Localization].relocalize(region, source=PART), within=left)
                return
            except (NotLocalized, Expired):
                if turns and Driving in robot and not _docked(context) and robot.clock.time() < deadline:
                    await errand.do(robot[Driving].move_by(Pose(yaw=TURN), source=PART))
                else:
                    await robot.clock.sleep(PAUSE_SECONDS)  # wait: several places fit
        raise NotLocalized(f"no matching place was found in {seconds:g} s")

    return run_errand(context.robot, "recover localization", work, region)


def manual_relocalization(context: Context, _: NoOptions) -> Action:
    """Search repeatedly while people push the robot, until a place fits or it is on its dock."""

    async def work(errand: Errand) -> None:
        robot = errand.robot
        begun = robot.clock.time()
        while not _docked(context) or (dock := home_dock(robot)) is None:
            try:
                await errand.do(robot[Localization].relocalize(source=PART), within=PLACE_SECONDS)
                return
            except (NotLocalized, Expired):
                await robot.clock.sleep(PAUSE_SECONDS)
        async with confirmed():
            robot[Localization].set_pose(dock.pose)
        context.events.note_reset(begun)

    return run_errand(context.robot, "manual relocalization", work)


def _docked(context: Context) -> bool:
    return DockContact in context.robot and context.robot[DockContact].docked
