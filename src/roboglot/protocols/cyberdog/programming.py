"""Visual programming's frames pass through here unread: 2002 down to the relay, 2001 up to the app."""

from __future__ import annotations

from roboglot.protocols.cyberdog.table import Call, operations, push
from roboglot.wire.cyberdog.codes import Code

TO_APP = push(Code.PROGRAM_TO_APP)


@operations.on(Code.PROGRAM_TO_ROBOT)
async def receive_frame(call: Call) -> None:
    """Pass the frame on; whatever is answered comes as push 2001. Without a relay it goes nowhere."""
    if call.dog.relay:
        await call.dog.relay.receive(call.text)
