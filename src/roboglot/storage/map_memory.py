"""The map in use, replaced in one transaction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from roboglot.model.components.mapping.map_memory import Drawings, MapMemory, Replacement
from roboglot.model.robot import Robot
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.files import StoredFiles
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings
from roboglot.storage.transactions import Connection, Transactions


class StoredMapMemory(MapMemory):
    """The map in use of one robot, in the same database as its parts."""

    def __init__(
        self,
        robot: Robot,
        database: Transactions,
        places: StoredPlaces,
        annotations: StoredAnnotations,
        settings: StoredSettings,
        files: StoredFiles,
    ) -> None:
        super().__init__(robot)
        self._database = database
        self._places, self._annotations, self._settings, self._files = places, annotations, settings, files

    async def check_store(self) -> None:
        async with self._places.turn, self._annotations.turn:
            await self._database.run(self._annotations.writing(self._annotations.current))

    async def replace(self, edit: Callable[[Drawings], Replacement]) -> None:
        async with self._places.turn, self._annotations.turn:
            before = self._annotations.current
            new = edit(Drawings(self._places.all(), before))
            places, drawn = new.drawings.places, new.drawings.annotations
            drawn = replace(drawn, last_id=max(drawn.last_id, before.last_id))
            writes = [
                self._places.writing(places, alone=True),
                self._annotations.writing(drawn),
                *(self._settings.writing(key, value) for key, value in new.settings.items()),
                *(self._files.writing(name, data) for name, data in new.files.items()),
            ]

            def work(connection: Connection) -> None:
                for write in writes:
                    write(connection)

            await self._database.run(work)
            self._places.adopt(places)
            self._annotations.adopt(drawn)
            for key, value in new.settings.items():
                self._settings.adopt(key, value)
