"""Translation of programs to fields of a frame and rows of a list (0.2.1.1 and 0.2.1.2 of the manual)."""

from __future__ import annotations

from roboglot.programs.stores import ListedProgram, StoredProgram
from roboglot.wire.visual.requests import FrameSubject, Request


def key_of(request: Request) -> str:
    """Return the contract's key of a request."""
    operates = request.kind in (FrameSubject.TASK, FrameSubject.MODULE)
    return f"{request.kind} {request.operate if operates else request.mode}"


def program(request: Request) -> StoredProgram:
    """Return the program that a frame asks to save."""
    return StoredProgram(
        id=request.targets[0],
        describe=request.describe,
        style=request.style,
        mode=request.mode,
        condition=request.condition,
        body=request.body,
        state="null",
    )


def item(listed: ListedProgram) -> dict[str, object]:
    """Return one row of a list (0.2.1.2.2.3 and .4); "operate" is the manual's name for the state."""
    return {
        "id": listed.id,
        "describe": listed.describe,
        "style": listed.style,
        "operate": listed.state,
        "mode": listed.mode,
        "condition": listed.condition,
        "dependent": listed.uses,
        "be_depended": listed.used_by,
    }
