"""Chapter "labels": maps and their named points: 6002, 6003."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused
from roboglot.clients.cyberdog.values import Label, LabelledMap
from roboglot.wire.cyberdog.codes import Code


class Labels(Calls):
    """The stored maps."""

    async def get_map(self, name: str = "") -> LabelledMap:
        """6003: return a map with its labels. Raises CyberDogRefused if there is none."""
        found = await self.ask(Code.GET_LABELS, LabelledMap, {"mapName": name}, within=15.0)
        if found.success:
            raise CyberDogRefused(Code.GET_LABELS.name, found.success, "there is no map")
        return found

    async def set_labels(self, map_name: str, labels: Sequence[Label]) -> None:
        """6002: replace all labels of a map."""
        await self.do(Code.SET_LABELS, {"mapName": map_name, "is_outdoor": False, "locationLabelInfo": labels})

    async def delete_labels(self, map_name: str, names: Sequence[str]) -> None:
        """6002: delete labels; do nothing without names, as that would delete the map."""
        if names:
            labels = [Label(name, 0.0, 0.0) for name in names]
            await self.do(Code.SET_LABELS, {"mapName": map_name, "locationLabelInfo": labels, "only_delete": True})

    async def delete_map(self, name: str) -> None:
        """6002: delete a map with its labels."""
        await self.do(Code.SET_LABELS, {"mapName": name, "only_delete": True})
