"""A robot's map as a small picture with the robot on it, for the grid of all robots."""

from __future__ import annotations

import io

import numpy as np

from roboglot.console.settings import THUMBNAIL_SIDE
from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid

UNKNOWN, FREE, OCCUPIED, ROBOT = (0, 0, 0, 0), (226, 232, 240, 255), (30, 41, 59, 255), (37, 99, 235, 255)
MARK = 3  # pixels from the robot marker's centre to its edge
MARKED_MIN = 4 * MARK  # pixels along the shorter side of a map; on a smaller one the marker would cover everything


def thumbnail(grid: OccupancyGrid, robot: Pose) -> bytes:
    """Return ``grid`` as a PNG of at most ``THUMBNAIL_SIDE`` pixels per side, x to the right, y up; walls stay visible.

    Takes some milliseconds: call it off the loop.
    """
    from PIL import Image

    step = max(1, -(-max(grid.width, grid.height) // THUMBNAIL_SIDE))
    rows, columns = -(-grid.height // step) or 1, -(-grid.width // step) or 1
    padded = np.zeros((rows * step, columns * step), grid.log_odds.dtype)
    padded[: grid.height, : grid.width] = grid.log_odds
    blocks = padded.reshape(rows, step, columns, step)
    picture = np.empty((rows, columns, 4), np.uint8)
    picture[:] = UNKNOWN
    picture[blocks.min(axis=(1, 3)) < 0] = FREE
    picture[blocks.max(axis=(1, 3)) > 0] = OCCUPIED
    row, column = grid.cell_of(robot)
    row, column = row // step, column // step
    if min(rows, columns) >= MARKED_MIN:
        picture[max(0, row - MARK) : max(0, row + MARK + 1), max(0, column - MARK) : max(0, column + MARK + 1)] = ROBOT
    file = io.BytesIO()
    Image.fromarray(picture[::-1]).save(file, "PNG")
    return file.getvalue()
