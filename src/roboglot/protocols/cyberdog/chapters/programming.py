"""Visual programming's frames pass through here unread: 2002 down to the relay, 2001 up to the app."""

from __future__ import annotations

from roboglot.model.clock import Clock
from roboglot.operations import Right
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.frame_queue import FrameQueue
from roboglot.protocols.cyberdog.table import TABLE, push, unread
from roboglot.wire.cyberdog.channel import PUSH_MAX
from roboglot.wire.cyberdog.codes import Code

TO_APP = push(Code.PROGRAM_TO_APP)
unread.add(Code.PROGRAM_TO_ROBOT)


def queue_to(app: AppLink, clock: Clock) -> FrameQueue:
    """Return the queue of frames to the app, open while the app is connected."""
    queue = FrameQueue(lambda text: app.send(TO_APP.code, text), clock, PUSH_MAX)
    app.on_found.append(queue.open)
    app.on_lost.append(queue.shut)
    return queue


@TABLE.on(Code.PROGRAM_TO_ROBOT, right=Right.SEE)
async def receive_frame(call: Call) -> None:
    """Pass the frame on, JSON or not; answers are pushes 2001. Without a relay it is dropped."""
    if call.context.relay and call.context.frames:
        await call.context.frames.drain_answers()
        await call.context.relay.receive(call.text)
