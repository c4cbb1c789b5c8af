"""The visual programming protocol: frames in, feedback, progress and responses out (chapter 0 of the manual).

The CyberDog door (codes 2002 and 2001) and this door's own WebSocket carry the frames.
"""

from __future__ import annotations

from roboglot.config import zone_of
from roboglot.operations import OperationTable
from roboglot.protocols.door import Contract, Door, DoorType, Implementation, Option, PortSetting, Site
from roboglot.protocols.visual.config import VisualConfig
from roboglot.wire.contracts import contract


def _open(config: VisualConfig, site: Site) -> Door:
    from roboglot.protocols.visual.mirror import CloudMirror
    from roboglot.protocols.visual.server import VisualDoor

    cloud = None
    if config.cloud:
        link = site.clouds.link(config.cloud, config.cloud_token)
        cloud = CloudMirror(link, site.clouds.outbox, site.robot.clock, site.clouds.failures)
    service = site.programs(zone_of(config.time_zone), not config.without_filter)
    door = site.frames = VisualDoor(service, site.address, config, cloud, site.tls)
    return door


def _functions() -> Implementation:
    from roboglot.programs.functions import prelude

    return prelude


def _frames() -> Implementation:
    from roboglot.protocols.visual import dispatch, table  # noqa: F401 - the chapters fill the table

    return table


def _table() -> OperationTable[str]:
    from roboglot.programs.functions import prelude, table  # noqa: F401 - the prelude fills the table

    return table.ABILITIES


DOOR = DoorType(
    name="visual",
    title="block programs",
    config=VisualConfig,
    contracts=(
        Contract("visual", lambda: contract("visual"), _functions),
        Contract("visual_frames", lambda: contract("visual_frames"), _frames),
    ),
    table=_table,
    ports=(PortSetting("block programs", "port"),),
    open=_open,
    options=(
        Option(
            "--programs-without-filter",
            "without_filter",
            "Run block programs even if the kernel cannot confine them: trusted programs only.",
            True,
        ),
    ),
    provides=True,
)
