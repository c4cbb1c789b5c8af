"""Slamtec's Slamware REST API 1.1.0 in front of one robot. One file per chapter of the manual."""

from __future__ import annotations

from roboglot.protocols.door import Chapters, Contract, Door, DoorType, PortSetting, Site
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.wire.contracts import contract


def _open(config: SlamwareConfig, site: Site) -> Door:
    from roboglot.protocols.slamware.server import SlamwareDoor

    return SlamwareDoor(site.robot, site.address, config, site.tls)


def _chapters() -> Chapters:
    from roboglot.protocols.slamware import dispatch, table  # noqa: F401 - the chapters fill the table

    return table


DOOR = DoorType(
    name="slamware",
    title="Slamware REST",
    config=SlamwareConfig,
    contracts=(Contract("slamware", lambda: contract("slamware"), _chapters),),
    table=lambda: _chapters().TABLE,
    ports=(PortSetting("Slamware", "port"),),
    open=_open,
)
