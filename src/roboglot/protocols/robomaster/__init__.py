"""The RoboMaster EP's plain-text SDK in front of a robot: TCP control and events, UDP pushes and discovery."""

from __future__ import annotations

from roboglot.protocols.door import Chapters, Contract, Door, DoorType, Option, PortKind, PortSetting, Site
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.wire.contracts import contract

EXPLANATION_PORT = 40928  # for `--explain`; RoboMaster clients do not use it


def _open(config: RoboMasterConfig, site: Site) -> Door:
    from roboglot.protocols.robomaster.server import RoboMasterDoor

    return RoboMasterDoor(site.robot, site.address, config)


def _chapters() -> Chapters:
    from roboglot.protocols.robomaster import dispatch, table  # noqa: F401 - the chapters fill the table

    return table


DOOR = DoorType(
    name="robomaster",
    title="RoboMaster text",
    config=RoboMasterConfig,
    contracts=(Contract("robomaster", lambda: contract("robomaster"), _chapters),),
    table=lambda: _chapters().TABLE,
    ports=(
        PortSetting("RoboMaster control", "control_port"),
        PortSetting("RoboMaster video", "video_port"),
        PortSetting("RoboMaster audio", "audio_port"),
        PortSetting("RoboMaster events", "event_port"),
        PortSetting("RoboMaster pushes", "push_port", PortKind.PUSH),
        PortSetting("RoboMaster discovery", "broadcast_port", PortKind.BROADCAST),
    ),
    open=_open,
    options=(
        Option(
            "--robomaster-profile",
            "profile",
            "Form of the RoboMaster door's answers: spec, or those of a firmware build: fw60, fw70.",
        ),
        Option("--robomaster-lenient", "lenient", "Also run RoboMaster commands sent without `;`.", True),
        Option(
            "--explain",
            "explanation_port",
            f"Say why RoboMaster commands are refused, on TCP port {EXPLANATION_PORT}.",
            EXPLANATION_PORT,
        ),
        Option("--uart", "uart", "Path of a RoboMaster serial line; -NAME of the robot is appended."),
    ),
)
