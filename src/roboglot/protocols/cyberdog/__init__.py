"""CyberDog 2's door: the phone app's gRPC service, in both directions."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.door import Chapters, Contract, Door, DoorType, Option, PortKind, PortSetting, Site
from roboglot.wire.contracts import contract


def _open(config: CyberDogConfig, site: Site) -> Door:
    from roboglot.protocols.cyberdog.server import CyberDogDoor

    return CyberDogDoor(site.robot, site.address, config, site.data, site.frames, site.people)


def _chapters() -> Chapters:
    from roboglot.protocols.cyberdog import server, table  # noqa: F401 - the server's chapters fill the table

    return table


def _notes() -> Sequence[str]:
    """Return notes on answers of real dogs that the manual omits."""
    from roboglot.protocols.cyberdog import table

    extras = table.extras()
    there, refused = (
        ", ".join(f"`{code}`" for code, yes in extras.items() if yes is wanted) for wanted in (True, False)
    )
    found = f"Real robots have {len(extras)} codes that the manual leaves out."
    return [f"{found} There: {there}. Refused: {refused or 'none'}."]


DOOR = DoorType(
    name="cyberdog",
    title="CyberDog 2 gRPC",
    config=CyberDogConfig,
    contracts=(Contract("cyberdog", lambda: contract("cyberdog"), _chapters, _notes),),
    table=lambda: _chapters().TABLE,
    ports=(PortSetting("CyberDog", "port"), PortSetting("CyberDog app", "app_port", PortKind.APP)),
    open=_open,
    credentials="a certificate of the data folder",
    options=(
        Option("--app", "app", "HOST:PORT of the CyberDog app to call; by default the app that called last."),
        Option("--plaintext", "plaintext", "CyberDog without TLS, on loopback only.", True),
    ),
)
