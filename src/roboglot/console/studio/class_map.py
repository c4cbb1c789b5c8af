"""The map of a pupil's robot, small, for the teacher's grid."""

from __future__ import annotations

import asyncio
import base64

from roboglot.console.thumbnails import thumbnail
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import ComponentMissing
from roboglot.model.robot import Robot


async def draw_map(robot: Robot) -> str:
    """Return a PNG in base64; empty for a robot without a map."""
    try:
        grid, pose = robot[Mapping].grid, robot[Localization].pose
    except ComponentMissing:
        return ""
    return base64.b64encode(await asyncio.to_thread(thumbnail, grid, pose)).decode()
