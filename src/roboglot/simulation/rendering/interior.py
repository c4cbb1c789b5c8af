"""Meshes of a floor's still things: walls by room, windows, door frames, furniture, docks, markers, lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

from roboglot.model.geometry import Pose
from roboglot.model.perception import TagKind
from roboglot.simulation.building.blueprint import Rectangle, Solid, SolidKind, holes_of
from roboglot.simulation.building.cards import PrintedTag
from roboglot.simulation.building.tags import fixed_tags
from roboglot.simulation.people import figure
from roboglot.simulation.rendering.figures import SHIRTS, person
from roboglot.simulation.rendering.floor_plan import Plan
from roboglot.simulation.rendering.shapes import EVERYWHERE, Mesh, Paint, Rgb, box, card, joined, mesh_of, turned
from roboglot.simulation.rendering.textures import Masks, Texture, code_symbol
from roboglot.simulation.world.description import (
    Colour,
    Floor,
    Line,
    Marker,
    Reflector,
    Terrain,
    Wall,
    WorldDescription,
)

WALLS: tuple[Rgb, ...] = (
    (226, 222, 212), (196, 212, 222), (222, 206, 180), (202, 216, 192),
    (224, 200, 196), (206, 202, 222), (228, 218, 170),
)  # fmt: skip
CLOTH: tuple[Rgb, ...] = ((62, 96, 140), (150, 72, 60), (78, 120, 92), (90, 90, 100), (190, 140, 60))
WOOD, WOOD_DARK = (206, 166, 116), (140, 96, 58)
WHITE, GREY, DARK = (240, 240, 238), (150, 152, 156), (52, 54, 60)
LEAVES: tuple[Rgb, ...] = ((64, 120, 60), (88, 146, 70), (70, 132, 62), (104, 160, 84))
COLOURS: dict[Colour, Rgb] = {
    "red": (214, 40, 40), "green": (30, 150, 70), "blue": (30, 90, 200), "yellow": (240, 200, 30),
    "black": (24, 24, 24), "white": (245, 245, 245),
}  # fmt: skip
GROUNDS: tuple[Paint, ...] = (
    Paint((150, 150, 146), (190, 190, 186), Texture.TILES),
    Paint((214, 176, 126), (132, 92, 56), Texture.WOOD),
    Paint((92, 108, 132), (66, 78, 100), Texture.CARPET),
    Paint((222, 220, 212), (170, 166, 158), Texture.TILES),
    Paint((128, 104, 92), (96, 80, 74), Texture.CARPET),
)
CEILING = Paint((150, 150, 150), (255, 255, 250), Texture.CEILING, glows=True)
SKY = Paint((150, 190, 230), glows=True)
GROUND_TILE = 2.0  # m of floor or ceiling per texture tile
LINTEL = 2.1  # m above which a doorway is closed, in pictures only
PROUD = 0.004  # m by which objects on a wall protrude
PAPER = 1.3  # of a printed code's size: its white margin included


def interior(floor: Floor, solids: Sequence[Solid], plan: Plan, masks: Masks) -> Iterator[Mesh]:
    """Yield all still things of a floor, except floor and ceiling."""
    for number, solid in enumerate(solids):
        if solid.kind is SolidKind.WALL:
            yield from _wall(solid, plan, floor)
        else:
            yield furniture(solid, number, plan.room_at(solid.pose.x, solid.pose.y))
    for wall in floor.walls:
        yield from _door_frames(wall, floor.height, plan)
    for marker in floor.markers:
        yield from _marker(marker, masks)
    for tag in fixed_tags(floor):
        yield printed(tag, masks)
    for foil in floor.reflectors:
        yield _foil(foil)
    for line in floor.lines:
        yield _tape(line)
    for terrain in floor.relief:
        yield _slope(terrain)
    for hole in holes_of(floor):
        yield _pit(hole)


def wall_paint(room: int, height: float) -> Paint:
    """Return plaster in the room's colour with a skirting board."""
    return Paint(WALLS[room % len(WALLS)], (84, 76, 70), Texture.WALL, (height, height))


def _plain(room: int) -> Rgb:
    """Return the mean colour of a room's plaster."""
    r, g, b = WALLS[room % len(WALLS)]
    return round(r * 0.96), round(g * 0.96), round(b * 0.96)


def _ahead(pose: Pose, way: float) -> tuple[float, float]:
    spot = pose.compose(Pose(way))
    return spot.x, spot.y


def _wall(solid: Solid, plan: Plan, floor: Floor) -> Iterator[Mesh]:
    """Yield the wall's four sides, cut where another room begins."""
    length, thickness, height = solid.size
    for turn, span, off in ((0, length, thickness / 2), (1, thickness, length / 2)):
        for side in (-1, 1):
            yaw = solid.pose.yaw + math.pi / 2 * (turn - 1 if side < 0 else turn + 1)
            middle = solid.pose.compose(Pose(0, side * off) if turn == 0 else Pose(side * off, 0))
            facing = Pose(middle.x, middle.y, yaw)
            for begin, end, room in _rooms_along(facing, span, plan):
                at = facing.compose(Pose(0, (begin + end) / 2))
                if room == 0 and floor.enclosed:
                    continue
                paint = wall_paint(room, height)
                yield card((at.x, at.y, solid.base + height / 2), yaw, (end - begin, height), paint, room)
                if _outer(facing, span, plan, thickness) and end - begin > 2.0:
                    yield from _windows(facing, begin, end, room)


def _rooms_along(facing: Pose, span: float, plan: Plan) -> Iterator[tuple[float, float, int]]:
    """Yield (begin, end, room) along the side of a wall (its local y, m), by the rooms in front of it."""
    steps = max(1, round(span / plan.cell))
    begin, last = -span / 2, None
    for step in range(steps):
        middle = -span / 2 + (step + 0.5) * span / steps
        spot = facing.compose(Pose(0.75 * plan.cell, middle))
        room = plan.room_at(spot.x, spot.y)
        if last is not None and room != last:
            edge = -span / 2 + step * span / steps
            yield begin, edge, last
            begin = edge
        last = room
    assert last is not None
    yield begin, span / 2, last


def _outer(facing: Pose, span: float, plan: Plan, thickness: float) -> bool:
    """True if there is no room behind the wall."""
    behind = facing.compose(Pose(-thickness - plan.cell, 0))
    return span > 2.0 and plan.room_at(behind.x, behind.y) == 0


def _windows(facing: Pose, begin: float, end: float, room: int) -> Iterator[Mesh]:
    glass = Paint((236, 238, 240), (176, 214, 246), Texture.WINDOW, (1.5, 1.4), glows=True)
    count = int((end - begin) / 2.4)
    for number in range(count):
        along = begin + (number + 0.5) * (end - begin) / count
        at = facing.compose(Pose(PROUD, along))
        yield card((at.x, at.y, 1.6), facing.yaw, (1.5, 1.4), glass, room)


def _door_frames(wall: Wall, height: float, plan: Plan) -> Iterator[Mesh]:
    """Yield two posts and a closed top for each doorway."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    start = Pose(x0, y0, math.atan2(y1 - y0, x1 - x0))
    frame, deep = Paint((122, 92, 66)), wall.thickness + 0.03
    for door in wall.doors:
        at = start.compose(Pose(door.at))
        for side in (-1, 1):
            post = box((0.05, deep, LINTEL), frame, frame)
            spot = at.compose(Pose(side * (door.width / 2 + 0.02)))
            yield post.placed(spot.x, spot.y, 0, at.yaw)
        if height > LINTEL + 0.1:
            beam = box((door.width + 0.09, deep, 0.06), frame, frame, LINTEL - 0.06)
            yield beam.placed(at.x, at.y, 0, at.yaw)
            for side in (-1, 1):
                front = at.compose(Pose(0, side * wall.thickness / 2, side * math.pi / 2))
                room = plan.room_at(*_ahead(front, 1.5 * plan.cell))
                middle = front.x, front.y, (height + LINTEL) / 2
                yield card(middle, front.yaw, (door.width, height - LINTEL), Paint(_plain(room)))


def furniture(solid: Solid, number: int, room: int) -> Mesh:
    """Return a box or cylinder as office furniture of its size."""
    width, depth, height = solid.size
    wood = Paint(WOOD, WOOD_DARK, Texture.WOOD, (1.0, 1.0))
    if solid.round:
        return _round(solid, number, room)
    if solid.base > 0.0:
        return _block(solid, wood, wood, room)
    if height >= 1.5 and max(width, depth) > 0.5:
        shelf = Paint((122, 90, 64), CLOTH[number % len(CLOTH)], Texture.SHELF, (1.2, height))
        return _block(solid, shelf, Paint(WOOD_DARK), room)
    if 0.6 <= height <= 1.2 and max(width, depth) > 0.75:
        drawers = Paint((196, 190, 180), (110, 100, 92), Texture.DRAWERS, (1.0, height))
        return _block(solid, drawers, wood, room)
    cloth = Paint(CLOTH[number % len(CLOTH)], (30, 30, 40), Texture.CARPET, (0.6, 0.6))
    return _block(solid, cloth, cloth, room)


@lru_cache(maxsize=128)
def movable(solid: Solid) -> Mesh:
    """Return a movable box at the origin, at its height above the floor."""
    match solid.kind:
        case SolidKind.DOCK:
            return joined(_dock(solid))
        case SolidKind.LANDING_DOOR:
            steel = Paint((176, 180, 186), (104, 106, 110), Texture.DRAWERS, (1.0, 3.2))
            return _block(solid, steel, Paint(GREY), EVERYWHERE)
        case SolidKind.SHELF:
            return _block(solid, Paint(WOOD), Paint(WOOD, WOOD_DARK, Texture.WOOD), EVERYWHERE)
        case SolidKind.PERSON:
            return person(len(SHIRTS) - 1, figure.UPRIGHT * figure.size(solid.size[2], max(solid.size[:2]) / 2))
        case _:
            return _carton(solid)


def _carton(solid: Solid) -> Mesh:
    """Return a cardboard box, for obstacles."""
    side = Paint((196, 158, 110), (226, 204, 160), Texture.BOX, solid.size[1:])
    top = Paint((206, 170, 122), (226, 204, 160), Texture.BOX, solid.size[:2])
    return box(solid.size, side, top, solid.base)


def _block(solid: Solid, side: Paint, top: Paint, room: int) -> Mesh:
    return box(solid.size, side, top, solid.base, room).placed(solid.pose.x, solid.pose.y, 0.0, solid.pose.yaw)


def _round(solid: Solid, number: int, room: int) -> Mesh:
    radius, base, top = solid.size[0] / 2, solid.base, solid.base + solid.size[2]
    if solid.size[2] > 2.5:
        profile = [(radius, base, wall_paint(0, solid.size[2])), (radius, top, Paint(WHITE))]
    elif solid.size[2] >= 1.0 and radius <= 0.35 and base == 0.0:
        pot = Paint((170, 96, 66))
        steps = [0.3 + (top - 0.3) * i / 4 for i in range(5)]
        leaves = [(radius, z, Paint(LEAVES[(i + number) % len(LEAVES)])) for i, z in enumerate(steps)]
        profile = [(radius * 0.98, 0.0, pot), (radius * 0.98, 0.3, Paint((60, 44, 34))), *leaves]
    elif radius < 0.1:
        profile = [(radius, base, Paint(DARK)), (radius, top, Paint(DARK))]
    else:
        side = Paint((196, 190, 180), (120, 110, 100), Texture.WOOD, (1.0, 1.0))
        profile = [(radius, base, side), (radius, top - 0.03, Paint(WOOD_DARK)), (radius, top, Paint(WOOD))]
    return turned(profile, 20 if radius > 0.1 else 8, room=room).placed(solid.pose.x, solid.pose.y, 0.0, 0.0)


def _dock(solid: Solid) -> Iterator[Mesh]:
    """Yield a dark dock, with a green lamp and a bright plate towards the room."""
    pose, (depth, width, height) = solid.pose, solid.size
    yield _block(solid, Paint(DARK), Paint(GREY), EVERYWHERE)
    front = pose.compose(Pose(depth / 2 + PROUD))
    yield card((front.x, front.y, height * 0.4), pose.yaw, (width * 0.6, height * 0.3), Paint((212, 214, 218)))
    lamp = Paint((60, 240, 120), glows=True)
    yield card((front.x, front.y, height * 0.88), pose.yaw, (width * 0.7, 0.02), lamp)


def _marker(marker: Marker, masks: Masks) -> Iterator[Mesh]:
    """Yield a black rim, and the symbol on white within."""
    yaw = math.radians(marker.facing)
    inner = 0.86 * marker.size
    paint = Paint((246, 246, 244), COLOURS[marker.colour], masks.symbol(marker.symbol), (inner, inner))
    pose = Pose(*marker.at, yaw)
    back, front = pose.compose(Pose(2 * PROUD)), pose.compose(Pose(3 * PROUD))
    yield card((back.x, back.y, marker.height), yaw, (marker.size, marker.size), Paint((20, 20, 20)))
    yield card((front.x, front.y, marker.height), yaw, (inner, inner), paint)


def symbols_of(world: WorldDescription) -> list[str]:
    """Return the names of all symbols on markers and tags."""
    names = [marker.symbol for floor in world.floors for marker in floor.markers]
    for floor in world.floors:
        names += [code_symbol(tag.kind, tag.text) for tag in floor.tags]
        numbers = [dock.tag for dock in floor.docks] + [shelf.tag for shelf in floor.shelves]
        names += [code_symbol(TagKind.APRIL, str(number)) for number in numbers if number is not None]
    return names


def printed(tag: PrintedTag, masks: Masks) -> Mesh:
    """Return a code on white paper."""
    pose, height, size = tag.card.pose, tag.card.height, tag.card.size
    squares = Paint((246, 246, 244), (18, 18, 18), masks.symbol(code_symbol(tag.kind, tag.text)), (size, size))
    back, front = pose.compose(Pose(2 * PROUD)), pose.compose(Pose(3 * PROUD))
    paper = PAPER * size
    return joined(
        [
            card((back.x, back.y, height), pose.yaw, (paper, paper), Paint((246, 246, 244))),
            card((front.x, front.y, height), pose.yaw, (size, size), squares),
        ]
    )


def _foil(foil: Reflector) -> Mesh:
    """Return a very bright strip, which seems to glow."""
    yaw, height = math.radians(foil.facing), foil.top - foil.base
    at = Pose(*foil.at, yaw).compose(Pose(2 * PROUD))
    return card((at.x, at.y, foil.base + height / 2), yaw, (foil.width, height), Paint((236, 240, 244), glows=True))


def _slope(terrain: Terrain) -> Mesh:
    """Return the tops and sides of a ramp or bump; ice is bright."""
    frame, half = Pose(*terrain.at, math.radians(terrain.facing)), terrain.width / 2
    first, second = ((206, 232, 244), (236, 246, 250)) if terrain.grip < 0.5 else ((168, 160, 146), (140, 132, 120))
    paint, side = Paint(first, second, Texture.CARPET), Paint(second)
    quads, paints = [], []
    for (a, low), (b, high) in pairwise(terrain.profile):
        (al, ar), (bl, br) = ([frame.compose(Pose(way, off)) for off in (half, -half)] for way in (a, b))
        low, high = max(low, 0.001), max(high, 0.001)
        quads += [
            [(ar.x, ar.y, low), (br.x, br.y, high), (bl.x, bl.y, high), (al.x, al.y, low)],
            [(ar.x, ar.y, 0.0), (br.x, br.y, 0.0), (br.x, br.y, high), (ar.x, ar.y, low)],
            [(bl.x, bl.y, 0.0), (al.x, al.y, 0.0), (al.x, al.y, low), (bl.x, bl.y, high)],
        ]
        paints += [paint, side, side]
    for way, height, ahead in ((*terrain.profile[0], -1), (*terrain.profile[-1], 1)):
        if height > 0.001:
            at = frame.compose(Pose(way, 0))
            yaw = frame.yaw if ahead > 0 else frame.yaw + math.pi
            dx, dy = -math.sin(yaw) * half, math.cos(yaw) * half
            quads.append([(at.x - dx, at.y - dy, 0.0), (at.x + dx, at.y + dy, 0.0), (at.x + dx, at.y + dy, height),
                          (at.x - dx, at.y - dy, height)])  # fmt: skip
            paints.append(side)
    return mesh_of(quads, paints)


def _pit(hole: Rectangle) -> Mesh:
    """Return a dark area in place of a hole."""
    x0, y0, x1, y1, z = hole.x, hole.y, hole.x + hole.width, hole.y + hole.depth, 0.001
    return mesh_of([[(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]], [Paint((12, 12, 14))])


def _tape(line: Line) -> Mesh:
    """Return a flat tape on the floor, with rounded bends."""
    quads, half, z = [], line.width / 2, 0.002
    for (ax, ay), (bx, by) in pairwise(line.points):
        yaw = math.atan2(by - ay, bx - ax)
        dx, dy = -math.sin(yaw) * half, math.cos(yaw) * half
        quads.append([(ax - dx, ay - dy, z), (bx - dx, by - dy, z), (bx + dx, by + dy, z), (ax + dx, ay + dy, z)])
    for x, y in line.points[1:-1]:
        around = [(x + half * math.cos(i * math.pi / 4), y + half * math.sin(i * math.pi / 4), z) for i in range(8)]
        quads += [[around[0], around[i], around[i + 1], around[i + 2]] for i in (1, 3, 5)]
    return mesh_of(quads, [Paint(COLOURS[line.colour])] * len(quads))
