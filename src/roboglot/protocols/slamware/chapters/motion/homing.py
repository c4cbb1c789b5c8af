"""Chapter "motion", POST actions: return to the dock or to a parking place."""

from __future__ import annotations

from roboglot.model.actions import Action
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import settle
from roboglot.model.components.motion.docking import BEFORE_DOCK, Docking
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Blocked, DockNotFound, NotFound, Unreachable
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.protocols.slamware.chapters.motion.errands import PART, Errand, run_errand
from roboglot.protocols.slamware.chapters.motion.home_docks import BOUND, NAME, known_docks
from roboglot.protocols.slamware.chapters.motion.moves import navigate, navigation_options
from roboglot.protocols.slamware.context import Context
from roboglot.wire.slamware.chapters.motion import GoHome, GoHomeOptions, MoveOptions, ReturnToParkingOptions
from roboglot.wire.slamware.chapters.platform import GeneralEvent

PARKING = "PARKING"  # the type of parking places


def go_home(context: Context, options: GoHomeOptions) -> Action:
    """Drive to the landing point, and by default onto the dock, with retries."""
    wanted = options.gohome_options or GoHome()
    how = wanted.move_options or MoveOptions()
    navigation_options(context.robot, how, None)  # refuse impossible requests now rather than on the way
    bound = context.robot[Settings].get(BOUND)
    if bound and bound not in {dock.id for dock in known_docks(context.robot)}:
        context.events.note(GeneralEvent.DOCK_ID_NOT_FOUND)  # it drives to another one

    async def work(errand: Errand) -> None:
        await head_home(errand, wanted)

    return run_errand(context.robot, "go home", work, context.robot[Docking].home)


async def head_home(errand: Errand, wanted: GoHome) -> None:
    """Drive to the dock of this floor."""
    how = wanted.move_options or MoveOptions()
    robot = errand.robot
    docking, stays_before = robot[Docking], wanted.flags == "no_dock"
    slower = docking.home is not None and navigation_options(robot, how, None).speed_ratio < 1.0
    if stays_before or how.mode or slower:
        if DockContact in robot and robot[DockContact].docked:
            return
        await _to_landing(errand, docking.home, how)
    if stays_before:
        return
    for tries_left in reversed(range(1 + (wanted.charging_retry_count or 0))):
        try:
            await errand.do(docking.dock(source=PART))
            return
        except DockNotFound:
            if tries_left:
                continue
            if wanted.back_to_landing and docking.home is not None:
                await _to_landing(errand, docking.home, how)
            raise


async def _to_landing(errand: Errand, home: Pose | None, how: MoveOptions) -> None:
    if home is None:
        raise DockNotFound("no dock is known")
    landing = home.compose(Pose(BEFORE_DOCK))
    await errand.do(navigate(errand.robot, [landing.point], how, source=PART, yaw=home.yaw))


def return_to_parking(context: Context, options: ReturnToParkingOptions) -> Action:
    """Drive to the named parking place, or to the nearest free one."""
    how = options.move_options or MoveOptions()
    navigation_options(context.robot, how, None)
    named = options.target.poi_name if options.target else ""

    async def work(errand: Errand) -> None:
        await settle(context.robot)
        here = [floor for floor in context.maps.floors if floor.name == context.maps.current]
        places = [place for floor in here for place in floor.places]
        await _park(errand, _parking(places, named), how)

    return run_errand(context.robot, "return to parking", work, named)


def _parking(places: list[PointOfInterest], named: str) -> list[PointOfInterest]:
    if named:
        found = [place for place in places if named in (place.metadata.get(NAME), place.id)]
        if not found:
            raise NotFound("POI not found")
        return found[:1]
    return [place for place in places if place.metadata.get("type", "").upper() == PARKING]


async def _park(errand: Errand, places: list[PointOfInterest], how: MoveOptions) -> None:
    """Park at the nearest of ``places``; if that is occupied, at the next."""
    here = errand.robot[Localization].pose
    problem: Blocked | Unreachable | None = None
    for place in sorted(places, key=lambda place: place.pose.distance_to(here)):
        try:
            await errand.do(navigate(errand.robot, [place.pose.point], how, source=PART, yaw=place.pose.yaw))
            return
        except (Blocked, Unreachable) as error:
            problem = error
    raise problem or NotFound("no parking place on this floor")
