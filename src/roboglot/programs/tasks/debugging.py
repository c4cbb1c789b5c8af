"""Debugging commands as JSON: breakpoints, and steps by statement or block. Our own protocol, for any carrier."""

from __future__ import annotations

import dataclasses
import json
from typing import Annotated, Literal

import msgspec

from roboglot.programs.engine.events import Stops
from roboglot.programs.errors import NotAllowed, ProgramError
from roboglot.programs.language.places import Step
from roboglot.programs.tasks.service import ProgramService
from roboglot.validation import why_invalid

STOPS_MAX = 1000  # lines per task, and blocks per task
STEPS = {"step": Step.INTO, "over": Step.OVER, "out": Step.OUT}
NAME_MAX = 256  # characters of a module's or a block's name
ID_MAX = 128  # characters of a task's id

Name = Annotated[str, msgspec.Meta(max_length=NAME_MAX)]
Line = Annotated[int, msgspec.Meta(ge=1, le=1_000_000)]


class Request(msgspec.Struct, forbid_unknown_fields=True):
    """Breakpoints at ``lines`` of the task's own text and of ``modules`` (by name) and at the beginning of ``blocks``.

    ``first``: halt before the next statement. ``first_block``: halt at the next begin of a block. ``watched``: allow
    stepping even without breakpoints.
    """

    target_id: Annotated[str, msgspec.Meta(min_length=1, max_length=ID_MAX)]
    operate: Literal["break", "step", "step_block", "over", "over_block", "out", "out_block", "go", "where"]
    lines: Annotated[list[Line], msgspec.Meta(max_length=STOPS_MAX)] = []
    modules: Annotated[dict[Name, list[Line]], msgspec.Meta(max_length=STOPS_MAX)] = {}
    blocks: Annotated[list[Name], msgspec.Meta(max_length=STOPS_MAX)] = []
    first: bool = False
    first_block: bool = False
    watched: bool = False


_decode = msgspec.json.Decoder(Request).decode


async def answer(service: ProgramService, text: str) -> str:
    """Execute a command; return the task's position afterwards, with the reason of a failure in ``error``."""
    try:
        request = _decode(text.encode("utf-8", "replace"))
    except (msgspec.MsgspecError, RecursionError) as error:
        return json.dumps(
            {"target_id": "", "operate": "", "error": why_invalid(error, wanted=Request)[:200]}, ensure_ascii=False
        )
    why = ""
    try:
        await _do(service, request)
    except ProgramError as error:
        why = str(error)
    where = dataclasses.asdict(await service.whereabouts(request.target_id))
    del where["began"], where["variables"]  # only for the studio
    return json.dumps(
        {"target_id": request.target_id, "operate": request.operate, "error": why} | where, ensure_ascii=False
    )


async def _do(service: ProgramService, request: Request) -> None:
    match request.operate:
        case "break":
            units = {"": request.lines} | request.modules
            lines = {(unit, line) for unit, inside in units.items() for line in inside}
            if len(lines) > STOPS_MAX:
                raise NotAllowed(f"more than {STOPS_MAX} lines")
            stops = Stops(
                frozenset(lines),
                frozenset(request.blocks),
                request.first,
                first_block=request.first_block,
                watched=request.watched,
            )
            await service.stop_at(request.target_id, stops)
        case "go":
            await service.recover(request.target_id)
        case verb if (step := STEPS.get(verb.removesuffix("_block"))) is not None:
            await service.step(request.target_id, step, to_block=verb.endswith("_block"))
