"""A map in the format of ROS's map_server: a yaml file beside a pgm image (http://wiki.ros.org/map_server)."""

from __future__ import annotations

import numpy as np

from roboglot.model.maps import OccupancyGrid

FREE, OCCUPIED, UNKNOWN = 254, 0, 205  # grey values of map_server


def encode_ros_map(grid: OccupancyGrid, name: str) -> tuple[bytes, bytes]:
    """Return the yaml file, which names ``name``.pgm, and that image; its first row has the highest y."""
    pixels = np.full(grid.log_odds.shape, UNKNOWN, np.uint8)
    pixels[grid.log_odds < 0] = FREE
    pixels[grid.log_odds > 0] = OCCUPIED
    image = b"P5\n%d %d\n255\n" % (grid.width, grid.height) + pixels[::-1].tobytes()
    about = (
        f"image: {name}.pgm\nmode: trinary\nresolution: {grid.resolution:.9g}\n"
        f"origin: [{grid.origin.x:.9g}, {grid.origin.y:.9g}, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return about.encode(), image
