"""Loading of a stored map: its cells, and the dock on it."""

from __future__ import annotations

from roboglot.model.components.mapping.map_library import StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.docking import Docking
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot


def load_map(robot: Robot, stored: StoredMap, pose: Pose) -> None:
    """Use ``stored`` from now on, with base_link at ``pose`` in it. Raises what ``Mapping.load`` raises."""
    robot[Mapping].load(stored.grid, pose)
    if stored.dock is not None and Docking in robot:
        robot[Docking].set_home(stored.dock)


def known_dock(robot: Robot) -> Pose | None:
    """Return where base_link stands in map when docked; None for a robot that knows no dock, or cannot dock."""
    return robot[Docking].home if Docking in robot else None
