"""Writes grids in the format of ROS's map_server."""

from __future__ import annotations

from pathlib import Path

from roboglot.media.ros_map import encode_ros_map
from roboglot.model.maps import OccupancyGrid
from roboglot.text_files import replacing


def write_ros_map(grid: OccupancyGrid, path: Path) -> None:
    """Write ``path`` (yaml) and the image beside it (pgm); on failure, existing ones stay."""
    about, image = encode_ros_map(grid, path.stem)
    with replacing(path) as text, replacing(path.with_suffix(".pgm")) as picture:
        text.write_bytes(about)
        picture.write_bytes(image)
