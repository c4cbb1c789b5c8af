"""cyberdog.touch and cyberdog.network: the touch pad, and the radio (4.4.02, 4.4.11)."""

from __future__ import annotations

import math

from roboglot.model.components.sensing.touch import Touch, TouchKind
from roboglot.model.components.system.network import Network
from roboglot.programs.functions.results import header
from roboglot.programs.functions.senses.sensors import epoch, newer
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

TOUCHES = {TouchKind.SINGLE: 1, TouchKind.DOUBLE: 2, TouchKind.LONG: 3}


@ABILITIES.on("cyberdog.touch.data", needs=(Touch,))
async def touch(session: Session) -> Record:
    """Last touch as TouchStatus (attribute): 1 once, 2 twice, 3 long, 0 none yet."""
    last = session.robot[Touch].last
    if last is None:
        return Record("TouchStatus")
    stamp, kind = last
    return Record("TouchStatus", {"header": header(epoch(session, stamp), "touch"), "touch_state": TOUCHES[kind]})


@ABILITIES.on("cyberdog.touch.get_data", needs=(Touch,))
async def next_touch(session: Session, timeout: int = 5) -> Record:
    """Return the next touch, or the last one after ``timeout`` seconds."""
    pad = session.robot[Touch]
    await newer(session, lambda: pad.last[0] if pad.last else -math.inf, timeout)
    return await touch(session)


@ABILITIES.on("cyberdog.network.data", needs=(Network,))
async def network(session: Session) -> Record:
    """State of the Wi-Fi card as ConnectorStatus (attribute); strength from 0 (-100 dBm) to 100 (-50 dBm).

    The robot's address and that of the network's access point are IPv4, "" without; ``code`` stays 0.
    """
    radio = session.robot[Network]
    card = radio.state
    strength = round(max(0.0, min(100.0, 2.0 * (radio.signal + 100.0))))
    return Record(
        "ConnectorStatus",
        {
            "is_connected": radio.connected,
            "is_internet": card.internet,
            "ssid": card.ssid,
            "robot_ip": card.address,
            "provider_ip": card.gateway,
            "strength": strength,
        },
    )
