"""Foxglove and Lichtblick in front of a robot: its topics live, driving by their panels, parameters."""

from __future__ import annotations

from roboglot.protocols.door import Chapters, ClosedDoor, Contract, Door, DoorType, Implementation, PortSetting, Site
from roboglot.protocols.foxglove.config import FoxgloveConfig
from roboglot.wire.contracts import contract


def _open(config: FoxgloveConfig, site: Site) -> Door:
    if not config.enabled:
        return ClosedDoor("foxglove")
    from roboglot.protocols.foxglove.server import FoxgloveDoor

    return FoxgloveDoor(site.robot, site.address, config, site.tls)


def _chapters() -> Chapters:
    from roboglot.protocols.foxglove import dispatch, table  # noqa: F401 - the chapters fill the table

    return table


def _messages() -> Implementation:
    from roboglot.protocols.foxglove.table import Messages

    return Messages()


DOOR = DoorType(
    name="foxglove",
    title="Foxglove",
    config=FoxgloveConfig,
    contracts=(
        Contract("foxglove", lambda: contract("foxglove"), _chapters),
        Contract("foxglove_messages", lambda: contract("foxglove_messages"), _messages),
    ),
    table=lambda: _chapters().TABLE,
    ports=(PortSetting("Foxglove", "port"),),
    open=_open,
)
