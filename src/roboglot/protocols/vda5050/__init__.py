"""VDA 5050 in front of a robot: fleet control sends orders over an MQTT broker, the robot reports its state there."""

from __future__ import annotations

from roboglot.protocols.door import (
    Chapters,
    ClosedDoor,
    Contract,
    Door,
    DoorType,
    Implementation,
    Option,
    PortKind,
    PortSetting,
    Site,
)
from roboglot.protocols.vda5050.config import Vda5050Config
from roboglot.wire.contracts import contract


def _open(config: Vda5050Config, site: Site) -> Door:
    if not config.broker:
        return ClosedDoor("vda5050")
    from roboglot.protocols.vda5050.server import Vda5050Door

    return Vda5050Door(site.robot, config)


def _chapters() -> Chapters:
    from roboglot.protocols.vda5050 import dispatch, table  # noqa: F401 - the chapters fill the table

    return table


def _messages() -> Implementation:
    from roboglot.protocols.vda5050.table import Messages

    return Messages()


DOOR = DoorType(
    name="vda5050",
    title="VDA 5050",
    config=Vda5050Config,
    contracts=(
        Contract("vda5050", lambda: contract("vda5050"), _chapters),
        Contract("vda5050_messages", lambda: contract("vda5050_messages"), _messages),
    ),
    table=lambda: _chapters().TABLE,
    ports=(PortSetting("VDA 5050 broker", "port", PortKind.BROKER),),
    open=_open,
    options=(
        Option("--vda5050", "broker", "HOST or HOST:PORT of the MQTT broker of a VDA 5050 fleet control."),
        Option("--vda5050-version", "version", "The fleet control's version of VDA 5050: 3.0 or 2.1."),
    ),
)
