"""cyberdog.navigation: drives to places marked on a saved map (4.4.05). Metres and rad in the map frame."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import replace

import numpy as np

from roboglot.confirmation import confirmed
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.localization import GOOD_FIT, Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import NAVIGATE, Navigation, NavigationOptions
from roboglot.model.errors import Busy, InvalidGoal, NotFound, NotLocalized, Refused, RobotError
from roboglot.model.events import MapReplaced
from roboglot.model.geodesy import sky_over
from roboglot.model.geometry import Point
from roboglot.model.map_loading import known_dock, load_map
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.programs.functions.audio import comment, turn_to, usable_volume
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

SUCCESS, UNAVAILABLE, FAILED, REFUSED, CANCELLED = 0, 2, 3, 4, 5  # NavigationActionResponse.response.result
COORDINATE_MAX = 10_000.0  # m
SAME_WALLS = 0.5  # share of a stored map's walls also present in the current map, if both have the same origin
WALL = 20  # log odds at which a cell counts as a wall
NEAR = 2  # cells by which walls may differ
HELP_SECONDS = 60.0  # s for a person to push the robot to a place that it recognizes
ASKED_EVERY = 20.0  # s between two requests for help
REQUEST = "I do not know where I am. Please take me to a place that I know"


class NavigationMode:
    """The map for which the program switched navigation on; a newer map may have its points elsewhere.

    It is off again once another client has replaced the map in use.
    """

    def __init__(self, _session: Session) -> None:
        self.map: str | None = None
        self._end_listening: Callable[[], None] | None = None

    def switch_on(self, name: str, robot: Robot) -> None:
        """Take the map of this name, which the robot uses now."""
        self.close()
        self.map = name
        self._end_listening = robot.events.listen(MapReplaced, lambda _: self.close())

    def close(self) -> None:
        """Forget the map; the program's end cancels its drive."""
        self.map = None
        if self._end_listening is not None:
            self._end_listening()
            self._end_listening = None


@ABILITIES.on("cyberdog.navigation.get_preset", needs=(MapLibrary,))
async def get_preset(session: Session) -> Record:
    """Return the points of the map saved last."""
    try:
        stored = await _newest(session.robot)
    except RobotError as error:
        return Record("MapPresetSeviceResponse", {"state": state(StateCode.FAIL, str(error))})
    points = {
        label.name: Record(
            "MsgPreset", {"label_name": label.name, "physic_x": label.point.x, "physic_y": label.point.y}
        )
        for label in stored.labels
    }
    fields = {
        "state": state(),
        "map_name": stored.name,
        "is_outdoor": stored.outdoor,
        "list": list(points.values()),
        "dictionary": points,
    }
    return Record("MapPresetSeviceResponse", fields)


@ABILITIES.on("cyberdog.navigation.turn_on_navigation", needs=(Localization, MapLibrary, Mapping, Speaker))
async def turn_on_navigation(
    session: Session,
    outdoor: bool = False,
    assisted_relocation: bool = False,
    interact: bool = False,
    volume: int = 50,
) -> Record:
    """Use the map saved last, ``outdoor`` or indoor, and find the robot's pose in it.

    With ``assisted_relocation`` a person has 60 s to take a robot that cannot find itself elsewhere; ``interact``: it
    asks for that, and says how it went.
    """
    doing = _turn_on(session, outdoor, assisted_relocation, interact)
    return await _outcome(_with_words(session, doing, interact, volume))


@ABILITIES.on("cyberdog.navigation.turn_off_navigation")
async def turn_off_navigation(session: Session) -> Record:
    """Cancel all drives to places, and switch navigation off."""
    session.part(NavigationMode).close()
    return await _outcome(_cancel(session.robot))


@ABILITIES.on("cyberdog.navigation.cancel_navigation")
async def cancel_navigation(session: Session) -> Record:
    """Cancel all drives to places; returns when the robot stands."""
    return await _outcome(_cancel(session.robot))


@ABILITIES.on("cyberdog.navigation.to_preset", needs=(Localization, MapLibrary, Mapping, Navigation, Speaker))
async def to_preset(
    session: Session,
    preset_name: str = "",
    assisted_relocation: bool = False,
    interact: bool = False,
    volume: int = 50,
) -> Record:
    """Switch navigation on, with the same help, and go to a point of the map saved last."""

    async def do() -> None:
        stored = await _newest(session.robot)
        point = _preset(stored, preset_name)
        await _turn_on(session, stored.outdoor, assisted_relocation, interact)
        await _go(session, point, None)

    return await _outcome(_with_words(session, do(), interact, volume))


@ABILITIES.on("cyberdog.navigation.navigation_to_preset", needs=(Localization, MapLibrary, Navigation))
async def navigation_to_preset(session: Session, preset_name: str = "") -> Record:
    """Go to a point of the map with which navigation was switched on."""

    async def do() -> None:
        stored = await session.robot[MapLibrary].get(_map_in_use(session))
        await _go(session, _preset(stored, preset_name), None)

    return await _outcome(do())


@ABILITIES.on("cyberdog.navigation.navigation_to_coordinates", needs=(Localization, Navigation))
async def navigation_to_coordinates(
    session: Session,
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
) -> Record:
    """Go to a pose on the map (m, rad); navigation must be on. z, roll and pitch are ignored."""

    async def do() -> None:
        _map_in_use(session)
        if not all(abs(value) <= COORDINATE_MAX for value in (x, y, z, roll, pitch, yaw)):
            raise InvalidGoal(f"coordinates are within {COORDINATE_MAX:g} m")
        await _go(session, Point(x, y), yaw)

    return await _outcome(do())


async def _turn_on(session: Session, outdoor: bool, assisted: bool, interact: bool) -> None:
    robot = session.robot
    stored = await _newest(robot, outdoor=outdoor)
    localization, mapping = robot[Localization], robot[Mapping]
    if not same_origin(stored.grid, mapping.grid):
        was, pose = mapping.grid, localization.pose
        home = known_dock(robot)
        async with confirmed():
            load_map(robot, stored, pose)
        try:
            await _find_itself(session, stored, assisted, interact)
        except (RobotError, asyncio.CancelledError):  # the second at the program's end
            if was.width:
                async with confirmed():
                    load_map(robot, replace(stored, grid=was, dock=home), pose)
            raise
    elif localization.quality < GOOD_FIT:
        await _find_itself(session, stored, assisted, interact)
    localization.enable(True)
    session.part(NavigationMode).switch_on(stored.name, robot)


async def _find_itself(session: Session, stored: StoredMap, assisted: bool, interact: bool) -> None:
    """Relocalize the robot; ``assisted``: retry for ``HELP_SECONDS`` while a person may help. Raises NotLocalized."""
    localization = session.robot[Localization]
    deadline, asked = session.awake + HELP_SECONDS, -ASKED_EVERY
    while True:
        began = session.awake
        try:
            sky = sky_over(stored.anchor, session.robot)
            await session.complete(localization.relocalize(sky.region if sky else None, source=session.source))
            if sky is None or sky.allows(localization.pose.point):
                return
            raise NotLocalized("the satellite fix places the robot elsewhere")
        except NotLocalized:
            if not assisted or session.awake >= deadline:
                raise
        if interact and session.awake - asked >= ASKED_EVERY:
            asked = session.awake
            await comment(session, REQUEST)
        await session.sleep(max(0.0, 1.0 - (session.awake - began)))


async def _go(session: Session, point: Point, yaw: float | None) -> None:
    navigation = session.robot[Navigation]
    await session.complete(navigation.navigate_to([point], NavigationOptions(yaw=yaw), source=session.source))


async def _cancel(robot: Robot) -> None:
    for action in robot.actions.running():
        if action.name == NAVIGATE:
            action.cancel("a program cancelled it")
            await action.done()


async def _with_words(session: Session, doing: Coroutine[object, object, None], interact: bool, volume: int) -> None:
    """Wait for ``doing``; with ``interact``, say the outcome."""
    try:
        usable_volume(volume)
        if interact:
            await turn_to(session.robot[Speaker], volume)
    except RobotError:
        doing.close()
        raise
    words = "navigation failed"
    try:
        await doing
        words = "navigation succeeded"
    finally:
        if interact:
            await comment(session, words)


async def _outcome(doing: Coroutine[object, object, None]) -> Record:
    outcome, result = state(), SUCCESS
    try:
        await doing
    except RobotError as error:
        outcome = state(StateCode.FAIL, str(error))
        match error:
            case Busy():
                result = CANCELLED
            case InvalidGoal():
                result = REFUSED
            case Refused():
                result = UNAVAILABLE
            case _:
                result = FAILED
    body = Record("NavigationActionResponseBody", {"result": result})
    return Record("NavigationActionResponse", {"state": outcome, "response": body})


def _map_in_use(session: Session) -> str:
    """Return the map's name. Raises Refused while navigation is off, NotLocalized while the robot is lost."""
    if (name := session.part(NavigationMode).map) is None:
        raise Refused("navigation is off")
    localization = session.robot[Localization]
    if localization.lost is not None:
        raise NotLocalized(f"the robot does not know where it is: {localization.lost}")
    if localization.quality < GOOD_FIT:
        raise NotLocalized("the robot does not know where it is")
    return name


def _preset(stored: StoredMap, name: str) -> Point:
    for label in stored.labels:
        if label.name == name:
            return label.point
    raise NotFound(f"the map {stored.name} has no label {name!r}")


async def _newest(robot: Robot, *, outdoor: bool | None = None) -> StoredMap:
    """Return the map saved last, of the given kind if any. Raises NotFound."""
    library = robot[MapLibrary]
    names = await library.names(outdoor=outdoor)
    if not names:
        raise NotFound("no map has been saved" if outdoor is None else f"no map of {'out' if outdoor else 'in'}doors")
    return await library.get(names[-1])


def same_origin(stored: OccupancyGrid, used: OccupancyGrid) -> bool:
    """Return whether both maps have their walls at the same places; after a restart the origin differs."""
    rows, columns = np.nonzero(stored.log_odds >= WALL)
    if not len(rows) or not used.width:
        return False
    x = stored.origin.x + (columns + 0.5) * stored.resolution
    y = stored.origin.y + (rows + 0.5) * stored.resolution
    row = np.floor((y - used.origin.y) / used.resolution).astype(int)
    column = np.floor((x - used.origin.x) / used.resolution).astype(int)
    walls = np.pad(used.log_odds >= WALL, NEAR)
    near = np.zeros_like(walls)
    for down in range(-NEAR, NEAR + 1):
        for right in range(-NEAR, NEAR + 1):
            near |= np.roll(walls, (down, right), (0, 1))
    inside = (row >= 0) & (column >= 0) & (row < used.height) & (column < used.width)
    found = near[row[inside] + NEAR, column[inside] + NEAR]
    return float(found.sum()) / len(rows) >= SAME_WALLS
