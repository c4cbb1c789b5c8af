"""ROS 2 in front of a robot, without ROS: its topics over Zenoh, as rmw_zenoh sends them."""

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
from roboglot.protocols.ros2.config import Ros2Config
from roboglot.wire.contracts import contract


def _open(config: Ros2Config, site: Site) -> Door:
    if not config.enabled:
        return ClosedDoor("ros2")
    from roboglot.protocols.ros2.server import Ros2Door

    return Ros2Door(site.robot, site.address, config)


def _chapters() -> Chapters:
    from roboglot.protocols.ros2 import dispatch, table  # noqa: F401 - the chapters fill the table

    return table


def _messages() -> Implementation:
    from roboglot.protocols.ros2.table import Messages

    return Messages()


DOOR = DoorType(
    name="ros2",
    title="ROS 2",
    config=Ros2Config,
    contracts=(
        Contract("ros2", lambda: contract("ros2"), _chapters),
        Contract("ros2_messages", lambda: contract("ros2_messages"), _messages),
    ),
    table=lambda: _chapters().TABLE,
    ports=(PortSetting("ROS 2 over Zenoh", "port", PortKind.ROUTER),),
    open=_open,
    options=(Option("--ros2", "enabled", "Publish the robots' topics for ROS 2 with rmw_zenoh.", True),),
)
