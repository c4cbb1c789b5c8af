"""Writes grids in the format of ROS's map_server."""

from __future__ import annotations

from pathlib import Path

from roboglot.media.ros_map import encode_ros_map
from roboglot.model.maps import OccupancyGrid


def write_ros_map(grid: OccupancyGrid, path: Path) -> None:
    """Write ``path`` (yaml) and the image beside it (pgm)."""
    about, image = encode_ros_map(grid, path.stem)
    path.with_suffix(".pgm").write_bytes(image)
    path.write_bytes(about)
