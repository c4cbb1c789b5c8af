"""Settings of the REST door."""

from __future__ import annotations

from roboglot.config import Port
from roboglot.values import dataclass

CONNECTIONS_MAX = 2048


@dataclass(frozen=True, slots=True)
class SlamwareConfig:
    """Settings of the REST door: port, prefix of action names, whether events stay after they were read, cloud.

    ``origins``: web pages of other hosts that may use it, such as "https://studio.example"; "*": any page. ``hosts``:
    names of this machine that clients use, beside its addresses, localhost and its own host name.
    """

    port: Port = 1448
    action_prefix: str = "slamtec.agent.actions."  # firmware 6 says "agent.actions."; both are always understood
    keep_events: bool = False
    cloud: str = ""  # a folder that simulates the maker's cloud, with one folder per robot; "": no cloud
    origins: tuple[str, ...] = ()
    hosts: tuple[str, ...] = ()
