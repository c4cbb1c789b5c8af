"""Saved maps in the database."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial

import numpy as np

from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geodesy import GlobeAnchor
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.storage.transactions import Connection, DiskFull, Transactions

MAPS_MAX = 100

Row = tuple[object, ...]


class StoredMaps(MapLibrary):
    """The saved maps of one robot."""

    def __init__(self, database: Transactions, robot: str) -> None:
        self._database = database
        self._robot = robot

    async def names(self, *, outdoor: bool | None = None, number: int | None = None) -> Sequence[str]:
        rows = await self._database.run(
            lambda c: c.execute(
                "SELECT name, outdoor, number FROM map WHERE robot=? ORDER BY seq", (self._robot,)
            ).fetchall()
        )
        return [
            name for name, outside, given in rows if outdoor in (None, bool(outside)) and number in (None, int(given))
        ]

    async def get(self, name: str) -> StoredMap:
        return await self._database.run(lambda connection: self._load(connection, name))

    async def put(self, stored: StoredMap) -> None:
        row = self._packed(stored)
        await self._database.run(lambda connection: self._put(connection, row))

    async def modify(self, name: str, edit: Callable[[StoredMap], StoredMap]) -> None:
        def work(connection: Connection, *, full: bool = False) -> None:
            old = self._load(connection, name)
            new = edit(old)
            if full and not _only_loses_labels(old, new):
                raise DiskFull("the disk is full")
            if new is not old:
                self._put(connection, self._packed(new))

        try:
            await self._database.run(work)
        except DiskFull:
            await self._database.remove(partial(work, full=True))

    def _load(self, connection: Connection, name: str) -> StoredMap:
        row = connection.execute(
            "SELECT width, height, resolution, origin_x, origin_y, grid, labels, saved_at, outdoor, number, anchor,"
            " dock FROM map WHERE robot=? AND name=?",
            (self._robot, name),
        ).fetchone()
        if row is None:
            raise NotFound(f"no map {name!r}")
        width, height, resolution, x, y, packed, labels, saved_at, outdoor, number, anchor, dock = row
        cells = np.frombuffer(zlib.decompress(packed), dtype=np.int8).reshape(height, width)
        return StoredMap(
            name,
            OccupancyGrid(cells, resolution, Point(x, y)),
            saved_at,
            tuple(Label(label["name"], Point(label["x"], label["y"]), label["kind"]) for label in json.loads(labels)),
            bool(outdoor),
            int(number),
            _anchor(anchor),
            None if dock is None else Pose(*json.loads(dock)),
        )

    def _packed(self, stored: StoredMap) -> Row:
        grid = stored.grid
        labels = [{"name": e.name, "x": e.point.x, "y": e.point.y, "kind": e.kind} for e in stored.labels]
        return (
            self._robot,
            stored.name,
            grid.width,
            grid.height,
            grid.resolution,
            grid.origin.x,
            grid.origin.y,
            zlib.compress(np.ascontiguousarray(grid.log_odds).tobytes()),
            json.dumps(labels),
            stored.saved_at,
            int(stored.outdoor),
            str(stored.number),
            _anchor_text(stored.anchor),
            None if stored.dock is None else json.dumps([stored.dock.x, stored.dock.y, stored.dock.yaw]),
        )

    def _put(self, connection: Connection, row: Row) -> None:
        others = connection.execute("SELECT count(*) FROM map WHERE robot=? AND name<>?", row[:2]).fetchone()[0]
        if others >= MAPS_MAX:
            raise InvalidGoal(f"more than {MAPS_MAX} maps")
        if (number := row[11]) != "0":
            taken = "UPDATE map SET number='0' WHERE robot=? AND name<>? AND number=?"
            connection.execute(taken, (*row[:2], number))
        connection.execute(
            "INSERT INTO map (robot, name, width, height, resolution, origin_x, origin_y, grid, labels, saved_at,"
            " outdoor, number, anchor, dock) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
            " ON CONFLICT (robot, name) DO UPDATE SET width=excluded.width,"
            " height=excluded.height, resolution=excluded.resolution, origin_x=excluded.origin_x,"
            " origin_y=excluded.origin_y, grid=excluded.grid, labels=excluded.labels, saved_at=excluded.saved_at,"
            " outdoor=excluded.outdoor, number=excluded.number, anchor=excluded.anchor, dock=excluded.dock",
            row,
        )

    async def remove(self, name: str) -> None:
        removed = await self._database.remove(
            lambda c: c.execute("DELETE FROM map WHERE robot=? AND name=?", (self._robot, name)).rowcount
        )
        if not removed:
            raise NotFound(f"no map {name!r}")


def _only_loses_labels(old: StoredMap, new: StoredMap) -> bool:
    same = all(getattr(new, one.name) is getattr(old, one.name) for one in fields(old) if one.name != "labels")
    return same and set(new.labels) < set(old.labels)


def _anchor_text(anchor: GlobeAnchor | None) -> str | None:
    if anchor is None:
        return None
    at = anchor.point
    return json.dumps([at.x, at.y, anchor.latitude, anchor.longitude, anchor.accuracy, anchor.north])


def _anchor(text: str | None) -> GlobeAnchor | None:
    if text is None:
        return None
    x, y, *rest = json.loads(text)
    return GlobeAnchor(Point(x, y), *rest)
