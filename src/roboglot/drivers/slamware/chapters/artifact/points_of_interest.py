"""A Slamware robot's points of interest."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Hashable, Mapping, Sequence

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.wire.slamware.chapters.artifact import PoseEntry, metadata_text
from roboglot.wire.slamware.geometry import Pose2D


class SlamwarePlaces:
    """Points of interest by ``artifact/v1/pois``."""

    def __init__(self, client: SlamwareClient) -> None:
        self._client = client

    async def read(self) -> Mapping[Hashable, PointOfInterest]:
        """Return all points of interest."""
        entries = await self._client.get_current_pois()
        return {
            entry.id: PointOfInterest(
                entry.id, Pose(entry.pose.x, entry.pose.y, entry.pose.yaw), metadata_text(entry.metadata)
            )
            for entry in entries
            if entry.pose is not None
        }

    async def write(self, places: Sequence[PointOfInterest], gone: Sequence[PointOfInterest]) -> Collection[Hashable]:
        """Apply the changes one by one; return the ids of refused places."""
        refused = set()
        for place in places:
            pose = Pose2D(place.pose.x, place.pose.y, place.pose.yaw)
            try:
                await self._client.add_pois(PoseEntry(place.id, pose, dict(place.metadata)))
            except SlamwareRefused:
                refused.add(place.id)
        for place in gone:
            with contextlib.suppress(SlamwareRefused):  # already gone
                await self._client.delete_poi(place.id)
        return refused
