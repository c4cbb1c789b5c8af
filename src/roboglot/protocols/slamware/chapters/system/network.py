"""Chapter "system": Wi-Fi, the preferred uplink, the mobile operator's access point name."""

from __future__ import annotations

from typing import Literal

from roboglot.model.components.system.network import MobileState, Network, NetworkMode, Uplink
from roboglot.model.errors import ComponentMissing, InvalidGoal
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.system.network import (
    ApnStatus,
    NetworkRequest,
    NetworkStatus,
    RequestedMode,
    RouteStatus,
    StationOptions,
    WrappedStatus,
)

API = "/api/core/system/v1/network"
PRIORITIES: dict[Uplink, Literal["wifi", "4g"]] = {Uplink.WIFI: "wifi", Uplink.MOBILE: "4g"}
BEST, WORST = -50.0, -100.0  # dBm that count as 100 and as 0


@TABLE.on(f"GET {API}/status", right=Right.SEE, needs=(Network,))
def get_network_status(context: Context) -> WrappedStatus:
    """Return the link of the Wi-Fi card; switched off, it is a station without a network."""
    network = context.robot[Network]
    state = network.state
    share = (network.signal - WORST) / (BEST - WORST) if network.connected else 0.0
    quality = 100 if state.mode is NetworkMode.ACCESS_POINT else round(100 * min(max(share, 0.0), 1.0))
    mode = "AP" if state.mode is NetworkMode.ACCESS_POINT else "STA"
    return WrappedStatus(NetworkStatus(state.wired, state.address, state.mac, mode, quality, state.ssid))


@TABLE.on(f"PUT {API}/status", right=Right.ADMIN, needs=(Network,))
async def set_network_status(context: Context, body: NetworkRequest) -> bool:
    """Become an access point, join a network (takes seconds; no change on failure), or switch a setting."""
    network = context.robot[Network]
    options = body.options if isinstance(body.options, StationOptions) else StationOptions()
    match body.networkmode:
        case RequestedMode.ACCESS_POINT:
            await network.be_access_point(options.ssid, options.password)
        case RequestedMode.STATION:
            if options.ssid is None or options.password is None:
                raise InvalidGoal("a station needs ssid and password")
            network.join(options.ssid, options.password, source=SOURCE)
        case RequestedMode.OFF:
            await network.switch_off()
        case RequestedMode.NO_DHCP | RequestedMode.DHCP:
            await network.set_dhcp(body.networkmode is RequestedMode.DHCP)
    return True


@TABLE.on(f"GET {API}/route", right=Right.SEE, needs=(Network,))
def get_network_route(context: Context) -> RouteStatus:
    """Return the preferred uplink."""
    return RouteStatus(PRIORITIES[context.robot[Network].priority])


@TABLE.on(f"PUT {API}/route", right=Right.ADMIN, needs=(Network,))
async def set_network_route(context: Context, body: RouteStatus) -> None:
    """Set the preferred uplink."""
    await context.robot[Network].set_priority(Uplink.WIFI if body.priority == "wifi" else Uplink.MOBILE)


@TABLE.on(f"GET {API}/apn", right=Right.SEE, needs=(Network,))
def get_cmlink_apn(context: Context) -> ApnStatus:
    """Return the modem's access point name."""
    if (mobile := context.robot[Network].mobile) is None:
        raise ComponentMissing(MobileState)
    return ApnStatus(mobile.apn)


@TABLE.on(f"PUT {API}/apn", right=Right.ADMIN, needs=(Network,))
async def set_cmlink_apn(context: Context, body: ApnStatus) -> None:
    """Set the modem's access point name; with a wrong one no operator accepts it."""
    await context.robot[Network].set_apn(body.apn)
