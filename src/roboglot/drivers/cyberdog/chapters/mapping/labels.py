"""Labels of a dog's map as places: named points. Headings and other metadata of places stay local."""

from __future__ import annotations

import uuid
from collections.abc import Collection, Hashable, Mapping, Sequence

from roboglot.clients.cyberdog import CyberDogClient, CyberDogRefused
from roboglot.clients.cyberdog.values import Label, LabelledMap
from roboglot.model.components.mapping.places import Places
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot

NAME = "display_name"
SAME = 0.005  # m


class CyberDogPlaces:
    """Labels by 6002 and 6003. Unnamed places are not sent; of two with the same name the later counts."""

    def __init__(self, robot: Robot, client: CyberDogClient) -> None:
        self._robot, self._client = robot, client
        self._map, self._labels = "", dict[str, Label]()
        self._last: dict[str, PointOfInterest] = {}  # by name: labels have no ids

    async def read(self) -> Mapping[Hashable, PointOfInterest]:
        """Return the labels of the current map. Raises CyberDogRefused for a dog without a map."""
        found: LabelledMap = await self._client.get_map()
        self._map = found.mapName
        self._labels = {label.labelName: label for label in found.locationLabelInfo}
        known = self._last | {place.metadata.get(NAME, ""): place for place in self._robot[Places].all()}
        self._last = {name: _place(label, known.get(name)) for name, label in self._labels.items()}
        return {place.id: place for place in self._last.values()}

    async def write(self, places: Sequence[PointOfInterest], gone: Sequence[PointOfInterest]) -> Collection[Hashable]:
        """Replace the whole list, the only way to change a label; return the ids of refused places."""
        named = {place.metadata[NAME]: place for place in places if place.metadata.get(NAME)}
        ids = {place.id for place in places}
        renamed = [name for name, place in self._last.items() if place.id in ids and name not in named]
        lost = [*dict.fromkeys((*(place.metadata.get(NAME, "") for place in gone), *renamed))]
        for name in lost:
            self._labels.pop(name, None)
        self._labels.update((name, Label(name, place.pose.x, place.pose.y)) for name, place in named.items())
        refused = {place.id for place in places if named.get(place.metadata.get(NAME, "")) is not place}
        try:
            if lost:
                await self._client.delete_labels(self._map, lost)
            if self._labels:
                await self._client.set_labels(self._map, list(self._labels.values()))
            self._last |= named
        except CyberDogRefused:
            return {place.id for place in places}
        return refused


def _place(label: Label, known: PointOfInterest | None) -> PointOfInterest:
    """Return the known place if it has not moved, else a new one."""
    at = Pose(label.physicX, label.physicY)
    if known is not None and known.pose.distance_to(at) < SAME:
        return known
    id = known.id if known else str(uuid.uuid5(uuid.NAMESPACE_OID, f"label {label.labelName}"))
    notes = known.metadata if known else {NAME: label.labelName}
    return PointOfInterest(id, at if known is None else Pose(at.x, at.y, known.pose.yaw), notes)
