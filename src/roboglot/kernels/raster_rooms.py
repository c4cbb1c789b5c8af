"""A floor's plan in cells: the rooms that connected cells form, and the rooms that are visible from a place."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray
from roboglot.kernels.compiled import kernel

ROOMS_MAX = 255  # room 0 is outside


@kernel("int64(uint8[:,::1], uint8[:,::1])")
def label(walls: ByteArray, rooms: ByteArray) -> int:
    """Number connected cells that are not ``walls`` 1, 2 … in ``rooms``; wall cells get a neighbour's number.

    Rooms beyond ROOMS_MAX share the last number. Returns how many rooms there are.
    """
    height, width = walls.shape
    stack = np.empty((height * width, 2), dtype=np.int32)
    head, tail, count = 0, 0, 0
    rooms[:] = 0
    for first_row in range(height):
        for first_column in range(width):
            if walls[first_row, first_column] or rooms[first_row, first_column]:
                continue
            count = min(count + 1, ROOMS_MAX)
            begin = tail
            stack[tail, 0], stack[tail, 1] = first_row, first_column
            tail += 1
            rooms[first_row, first_column] = count
            head = begin
            while head < tail:
                row, column = stack[head, 0], stack[head, 1]
                head += 1
                for step in range(4):
                    r, c = row + (step == 0) - (step == 1), column + (step == 2) - (step == 3)
                    if 0 <= r < height and 0 <= c < width and not walls[r, c] and not rooms[r, c]:
                        rooms[r, c] = count
                        stack[tail, 0], stack[tail, 1] = r, c
                        tail += 1
    head = 0  # starting from every free cell, into the walls, breadth first
    while head < tail:
        row, column = stack[head, 0], stack[head, 1]
        head += 1
        for step in range(4):
            r, c = row + (step == 0) - (step == 1), column + (step == 2) - (step == 3)
            if 0 <= r < height and 0 <= c < width and not rooms[r, c]:
                rooms[r, c] = rooms[row, column]
                stack[tail, 0], stack[tail, 1] = r, c
                tail += 1
    return count


@kernel("void(uint8[:,::1], uint8[:,::1], float64, float64, float64, float64, uint8[::1])")
def look(solid: ByteArray, rooms: ByteArray, x: float, y: float, yaw: float, spread: float, visible: ByteArray) -> None:
    """Mark in ``visible`` every room whose cells are met within ``spread`` rad around ``yaw`` before a solid cell.

    (x, y) in cells. The first three cells never stop a look: a wall's cell may reach a little beyond the wall.
    """
    height, width = solid.shape
    rays = max(8, int(spread / 0.006))
    reach = 2 * (height + width)
    for ray in range(rays + 1):
        angle = yaw + spread * (ray / rays - 0.5)
        dx, dy = 0.5 * np.cos(angle), 0.5 * np.sin(angle)
        for step in range(reach):
            column, row = int(np.floor(x + dx * step)), int(np.floor(y + dy * step))
            if column < 0 or row < 0 or column >= width or row >= height:
                break
            visible[rooms[row, column]] = 1
            if step > 6 and solid[row, column]:
                break
