"""The life of one program inside the jail: receive it, check it, run it, report its end. Knows no robot."""

from __future__ import annotations

import gc
import os
import socket
import sys
from collections.abc import Callable
from functools import partial
from types import CodeType
from typing import Any

from roboglot.programs.language import Problem, ProblemKind, check, compile_unit, uses
from roboglot.programs.language.instrument import Marks
from roboglot.programs.language.places import Places
from roboglot.programs.worker.environment import build_builtins
from roboglot.programs.worker.frames import ERROR_MAX
from roboglot.programs.worker.link import EXIT_MEMORY, HALT, NOTHING, HostLink
from roboglot.programs.worker.modules import build_modules
from roboglot.programs.worker.position import PositionMemory
from roboglot.programs.worker.prelude import Prelude
from roboglot.programs.worker.roots import build_enums, build_roots
from roboglot.programs.worker.variables import UNIT, Variables

EXIT_DONE, EXIT_BROKEN, EXIT_UNTOLD = 0, 70, 72
"""Exit codes: success, a fault of ours, and (of the probe) a Python with an unknown layout of lists."""

_RESERVE = 512 * 1024
_OWN_DEPTH = 16
_REHEARSED, _REHEARSED_MAX = 32, 4096  # calls, and bytes of one


def main(descriptor: int, positions: PositionMemory) -> int:
    """Serve the one request on the socket; return the exit code. The jail is already closed."""
    link = HostLink(descriptor)
    reserve = bytearray(_RESERVE)  # released when memory runs out, so that the report can still be written
    try:
        request = link.receive()
        if request["t"] == "check":
            functions = frozenset(request["functions"])
            problems = check(request["source"], Prelude.from_wire(request["prelude"]).names(functions))
            used = uses(request["source"], functions)
            link.send({"t": "checked", "problems": [_plain(problem) for problem in problems], "uses": used})
        else:
            link.send(_run(link, request, positions))
    except MemoryError as error:
        unit, number = _place(error)
        error.__traceback__ = None  # its frames hold the data that filled the memory
        positions.forget()
        del reserve
        gc.collect()
        link.send(_failure("MemoryError", "the program used more memory than it may", unit, number))
        return EXIT_MEMORY
    return EXIT_DONE


def probe(positions: PositionMemory) -> int:
    """Probe the lockdown in a throw-away child; return 0 if the filter works and lines can be reported."""
    if not positions.works():
        return EXIT_UNTOLD
    for attempt in (partial(os.open, "/", os.O_RDONLY), os.fork, os.getppid):
        try:
            result = attempt()
        except PermissionError:
            continue
        if attempt is os.getppid and result == -1:  # this one cannot fail
            continue
        return 1
    return 0


def rehearse() -> None:
    """Warm up in the process that programs are forked from, so that no program pays for first uses."""
    source = "def f(x):\n    return [x + 1]\nfor i in range(2):\n    print(f(i))\n"
    compile_unit(source, "", 0, Marks([None], lambda *_: object()), policy=True)
    check(source, Prelude().names())
    near, far = socket.socketpair()
    with near, far:
        call = build_roots(Prelude(frozenset({"call"})), HostLink(near.fileno()).call)["call"]
        assert callable(call)
        for number in range(_REHEARSED):  # Python adapts code to its values only after some calls
            far.sendall(NOTHING)
            call(number, "")
            far.recv(_REHEARSED_MAX)


def _plain(problem: Problem) -> list[object]:
    return [problem.line, problem.column, str(problem.kind), problem.english, problem.chinese]


def _run(link: HostLink, request: dict[str, Any], positions: PositionMemory) -> dict[str, Any]:
    units: list[CodeType] = []
    positions.lay_out(Places(request["units"]))
    variables = Variables(link.send)

    def halt() -> None:
        variables.report()
        link.call(HALT)

    cell = positions.watched(halt) if request["watched"] else positions.cell
    marks = Marks(cell, positions.mark)
    for number, source in enumerate(request["units"]):
        built = compile_unit(source, f"{UNIT}{number}>", number, marks, policy=request["policy"])
        if isinstance(built, list):
            first = built[0]
            kind = "PolicyError" if first.kind is ProblemKind.POLICY else "SyntaxError"
            return _failure(kind, first.english, number, first.line)
        units.append(built)
    if request["watched"]:
        positions.settle()
    scope = _globals(link, request, variables.before(link.call) if request["watched"] else link.call)
    variables.hide(scope)
    # Modules first, the program (unit 0) last; all share one namespace, as the vendor's programs expect.
    sys.setrecursionlimit(request["recursion"] + _OWN_DEPTH)
    try:
        for code in [*units[1:], units[0]]:
            exec(code, scope)
    except SystemExit as stop:
        if stop.code in (None, 0):
            return {"t": "finished"}
        return _report(stop)
    except MemoryError:
        raise
    except BaseException as error:  # noqa: BLE001 - any error ends the program
        return _report(error)
    return {"t": "finished"}


def _globals(link: HostLink, request: dict[str, Any], call: Callable[..., Any]) -> dict[str, Any]:
    prelude = Prelude.from_wire(request["prelude"])
    link.records = type(link.records)(prelude.records)
    modules = build_modules(call, request["seed"], prelude.utc_offset)
    own_builtins = build_builtins(link.write, modules)
    scope: dict[str, object] = {
        "__name__": "__main__",
        "time": modules["time"],
        **build_roots(prelude, call),
        **build_enums(prelude),
        **{name: link.records.class_of(name) for name, kind in prelude.records.items() if kind.constructible},
    }
    if request["policy"]:
        return {**scope, "__builtins__": own_builtins}
    return {**scope, "print": own_builtins["print"]}


def _report(error: BaseException) -> dict[str, object]:
    unit, line = _place(error)
    try:
        message = str(error)
    except BaseException:  # noqa: BLE001 - the program's own __str__
        message = ""
    return _failure(type(error).__name__, message, unit, line)


def _failure(kind: str, message: str, unit: int, line: int) -> dict[str, object]:
    return {"t": "failed", "type": kind[:200], "message": message[:ERROR_MAX], "unit": unit, "line": line}


def _place(error: BaseException) -> tuple[int, int]:
    """Return the innermost place in the program's own text."""
    unit = line = 0
    traceback = error.__traceback__
    while traceback is not None:
        filename = traceback.tb_frame.f_code.co_filename
        if filename.startswith(UNIT):
            unit, line = int(filename[len(UNIT) : -1]), traceback.tb_lineno
        traceback = traceback.tb_next
    return unit, line
