"""Doors: one package per protocol, each described by its ``DOOR``. A further door is one more line."""

from __future__ import annotations

from roboglot.config import Config
from roboglot.protocols import cyberdog, foxglove, robomaster, ros2, slamware, vda5050, visual
from roboglot.protocols.door import Door, DoorType, Site

DOORS: tuple[DoorType, ...] = (
    slamware.DOOR,
    robomaster.DOOR,
    cyberdog.DOOR,
    visual.DOOR,
    vda5050.DOOR,
    foxglove.DOOR,
    ros2.DOOR,
)


def sections(doors: tuple[DoorType, ...] = DOORS) -> dict[str, type]:
    """Return the types of the doors' sections of the configuration, by name."""
    return {door.name: door.config for door in doors}


def open_doors(site: Site, config: Config, doors: tuple[DoorType, ...] = DOORS) -> list[Door]:
    """Make the doors of one robot, in their order."""
    made = {
        door.name: door.open(door.section(config), site) for door in sorted(doors, key=lambda door: not door.provides)
    }
    return [made[door.name] for door in doors]
