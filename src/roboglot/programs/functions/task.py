"""cyberdog.task: blocks, breakpoints and the task's own end (4.4.06)."""

from __future__ import annotations

from roboglot.programs.functions.results import state
from roboglot.programs.functions.session import Session, TaskEnded
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

BLOCK_ID_MAX = 256  # characters; the vendor's editor uses 20


@ABILITIES.on("cyberdog.task.start")
async def start(_session: Session) -> Record:
    """Mark the task as running; a program that can call this runs already, and run x start stays run."""
    return state()


@ABILITIES.on("cyberdog.task.stop")
async def stop(_session: Session) -> Record:
    """End the task here: the last block ends, nothing after this call runs."""
    raise TaskEnded


@ABILITIES.on("cyberdog.task.block")
async def block(session: Session, id: str = "") -> Record:
    """The block before ends, this one begins; front ends see both."""
    session.host.begin_block(_usable(id))
    return state()


@ABILITIES.on("cyberdog.task.breakpoint_block")
async def breakpoint_block(session: Session, id: str = "") -> Record:
    """A block before whose first statement the task is suspended until a user recovers it."""
    session.host.begin_block(_usable(id))
    await session.host.breakpoint()
    return state()


@ABILITIES.on("cyberdog.task.recover")
async def recover(_session: Session) -> Record:
    """Go on after a breakpoint; a program that can call this is not held by one, and run x recover stays run."""
    return state()


def _usable(id: str) -> str:
    if len(id) > BLOCK_ID_MAX or any("\ud800" <= character <= "\udfff" for character in id):
        raise ValueError(f"a block's id is text of at most {BLOCK_ID_MAX} characters")
    return id
