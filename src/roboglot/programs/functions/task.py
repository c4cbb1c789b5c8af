"""cyberdog.task: blocks, breakpoints and the task's own end (4.4.06)."""

from __future__ import annotations

from roboglot.programs.functions.results import state
from roboglot.programs.functions.session import Session, TaskEnded
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

BLOCK_ID_MAX = 256  # characters; the vendor's editor uses 20


@ABILITIES.on("cyberdog.task.start")
async def start(_session: Session) -> Record:
    """Mark the task as running. A program that can call this is running, so the call changes nothing."""
    return state()


@ABILITIES.on("cyberdog.task.stop")
async def stop(_session: Session) -> Record:
    """End the task here, with its last block; nothing after this call runs."""
    raise TaskEnded


@ABILITIES.on("cyberdog.task.block")
async def block(session: Session, id: str = "") -> Record:
    """Begin a block; the one before ends, and front ends show both."""
    session.host.begin_block(_usable(id))
    return state()


@ABILITIES.on("cyberdog.task.breakpoint_block")
async def breakpoint_block(session: Session, id: str = "") -> Record:
    """Begin a block, and suspend the task before its first statement until a user recovers it."""
    session.host.begin_block(_usable(id))
    await session.host.breakpoint()
    return state()


@ABILITIES.on("cyberdog.task.recover")
async def recover(_session: Session) -> Record:
    """Continue after a breakpoint. A program that can call this is running, so the call changes nothing."""
    return state()


def _usable(id: str) -> str:
    if len(id) > BLOCK_ID_MAX or any("\ud800" <= character <= "\udfff" for character in id):
        raise ValueError(f"a block's id is text of at most {BLOCK_ID_MAX} characters")
    return id
