"""Chapter 6.2.3: stored maps of the robot."""

from __future__ import annotations

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import Refused
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import Context
from roboglot.protocols.vda5050.table import TABLE
from roboglot.wire.vda5050.orders import Id, Text


@TABLE.on("enableMap", right=Right.EDIT, needs=(MapLibrary, Mapping, Localization))
async def enable_map(context: Context, *, mapId: Id, mapVersion: Text = "") -> str:  # noqa: N803 - the standard's words
    """Switch to a stored map once the robot is localized in it; otherwise the current map stays."""
    if mapId == context.map_id:
        return "it is in use"
    if context.book.nodes:
        raise Refused(f"order {context.book.order_id} is being driven in {context.map_id!r}")
    await context.maps.change(await context.maps.kept(mapId, mapVersion))
    return ""


@TABLE.on("deleteMap", right=Right.EDIT, needs=(MapLibrary,))
async def delete_map(context: Context, *, mapId: Id, mapVersion: Text = "") -> str:  # noqa: N803
    """Delete a stored map that is not in use."""
    if mapId == context.map_id:
        raise Refused(f"{mapId!r} is in use")
    await context.maps.kept(mapId, mapVersion)
    await context.maps.remove(mapId)
    return ""
