"""``roboglot program``: checks, saves, runs and watches block programs, on a running robot or a separate one."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import json
import logging
import re
import sys
from collections.abc import AsyncIterator, Coroutine
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from roboglot.cli.programs.stepping import Stepper
from roboglot.clients.errors import ClientError, LinkLost
from roboglot.clients.visual import TextLink
from roboglot.config import RobotConfig
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import visible
from roboglot.protocols.visual.config import VisualConfig
from roboglot.text_files import named_text_of
from roboglot.values import dataclass

ROBOT = "ws://127.0.0.1:50053"
FRAMES, LOG, DEBUG, RUNS = "/programs", "/log", "/debug", "/runs"
TaskFrame = dict[str, Any]
Stops = tuple[list[int], bool]  # lines, and whether to stop before the first statement


class ProgramOperation(StrEnum):
    """Operation."""

    CHECK = "check"
    RUN = "run"
    SAVE = "save"
    LIST = "list"
    LOG = "log"
    SUSPEND = "suspend"
    RECOVER = "recover"
    SHUTDOWN = "shutdown"
    DELETE = "delete"


@dataclass(frozen=True, slots=True)
class Request:
    """Operation on a task (or module); ``saving``: its fields when saved."""

    what: ProgramOperation
    task: str
    saving: dict[str, str]
    module: bool = False
    as_json: bool = False


READING = (ProgramOperation.CHECK, ProgramOperation.RUN, ProgramOperation.SAVE)


class Failure(Exception):
    """The robot refused or the program failed: exits with status 1 and a message (empty if already printed)."""


def command(
    what: Annotated[ProgramOperation, typer.Argument(help="The action; check needs no robot.")],
    file: Annotated[
        Path | None, typer.Argument(help="The program's file, or a task's id where no file is read.")
    ] = None,
    robot: Annotated[str, typer.Option(envvar="ROBOGLOT_PROGRAMS", help="The robot's WebSocket.")] = ROBOT,
    own: Annotated[bool, typer.Option("--own", help="Run it on a new simulated robot.")] = False,
    body: Annotated[str, typer.Option(help="With --own: the robot's body.")] = "cyberdog2",
    world: Annotated[str, typer.Option(help="With --own: the robot's world.")] = "office",
    speed: Annotated[float, typer.Option(help="With --own: robot seconds per real second.")] = 1.0,
    id: Annotated[str, typer.Option(help="The task's id; by default made from the file's name.")] = "",
    when: Annotated[str, typer.Option(help='"now", "21:30", "now + 5minutes"; with --cycle "30 21 * * *".')] = "now",
    step: Annotated[bool, typer.Option("--step", help="Halt before every statement.")] = False,
    breaks: Annotated[list[int] | None, typer.Option("--break", help="Line to halt at; repeat for more.")] = None,
    cycle: Annotated[bool, typer.Option("--cycle", help="Repeat at the times of --when.")] = False,
    interface: Annotated[
        str, typer.Option(metavar="NAME(PARAMETERS)", help="Save it as a module with this interface.")
    ] = "",
    modules: Annotated[bool, typer.Option("--modules", help="List or delete modules instead of tasks.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="With list, log or check: print one JSON text.")] = False,
) -> None:
    """Check, run, save and list block programs, read their logs; suspend, recover, shut down and delete their tasks."""
    logging.basicConfig(level=logging.WARNING)
    if file is None and what is not ProgramOperation.LIST:
        sys.exit(f"roboglot program {what}: which file?")
    _refuse_misfits(what, interface=interface, modules=modules, as_json=as_json)
    source = ""
    try:
        if file is not None and what in READING:
            source = named_text_of(file, encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        sys.exit(f"roboglot program: {in_words(error)}")
    task = id or re.sub(r"\W", "_", file.stem if file else "", flags=re.ASCII)
    saving = {"mode": "cycle" if cycle else "single", "condition": when, "body": source}
    if interface:
        saving = {"mode": "common", "condition": interface, "body": source, "describe": interface}
    if what is ProgramOperation.CHECK:
        sys.exit(asyncio.run(_check(file or Path(), source, as_json=as_json)))
    place = own_robot(body, world, speed) if own else contextlib.nullcontext(robot.removesuffix(FRAMES))
    try:
        asyncio.run(
            _at(place, Request(what, task, saving, modules or bool(interface), as_json), _stops(breaks, step=step))
        )
    except (ClientError, Failure, ValueError, OSError) as error:
        sys.exit(f"roboglot program: {visible(in_words(error))}" if str(error) else 1)


def _refuse_misfits(what: ProgramOperation, *, interface: str, modules: bool, as_json: bool) -> None:
    if interface and what is not ProgramOperation.SAVE:
        raise typer.BadParameter("--interface is for save")
    if modules and what not in (ProgramOperation.LIST, ProgramOperation.DELETE):
        raise typer.BadParameter("--modules is for list and delete")
    if as_json and what not in (ProgramOperation.LIST, ProgramOperation.LOG, ProgramOperation.CHECK):
        raise typer.BadParameter("--json is for list, log and check")


def _stops(breaks: list[int] | None, *, step: bool) -> Stops | None:
    return (breaks or [], step) if breaks or step else None


async def _check(file: Path, source: str, *, as_json: bool) -> int:
    """Print errors, as compilers do; return the exit status."""
    from roboglot.programs.engine.engine import Engine, EngineError, SandboxUnavailable
    from roboglot.programs.functions.prelude import ability_set

    try:
        async with Engine() as engine:
            problems = await engine.check(source, ability_set())
    except (EngineError, SandboxUnavailable, ValueError) as error:
        print(f"roboglot program: {error}", file=sys.stderr)
        return 1
    if as_json:
        rows = [dataclasses.asdict(problem) | {"kind": str(problem.kind)} for problem in problems]
        print(json.dumps({"file": str(file), "problems": rows}, ensure_ascii=False))
        return 1 if problems else 0
    for problem in problems:
        print(visible(f"{file}:{problem.line}:{problem.column}: {problem.english} {problem.chinese}"))
    if not problems:
        print(f"{file}: no errors")
    return 1 if problems else 0


async def _at(place: contextlib.AbstractAsyncContextManager[str], request: Request, stops: Stops | None) -> None:
    async with place as address, _link(address, FRAMES) as frames, _link(address, LOG) as log:
        task, kind = request.task, "module" if request.module else "task"
        match request.what:
            case ProgramOperation.LIST:
                await _list(address, frames, kind, as_json=request.as_json)
            case ProgramOperation.LOG:
                await log.send(task)
                if not await _print_log(log, task, as_json=request.as_json) and not await _known(frames, task):
                    raise Failure(f"there is no task {task}")
            case (
                ProgramOperation.SUSPEND
                | ProgramOperation.RECOVER
                | ProgramOperation.SHUTDOWN
                | ProgramOperation.DELETE
            ):
                await _ask(frames, request.what, task, type=kind)
                print(f"{task}: {request.what} accepted")
            case ProgramOperation.SAVE:
                await _ask(frames, "save", task, type=kind, **request.saving)
                print(f"{task} is saved")
            case ProgramOperation.RUN:
                await _ask(frames, "save", task, **request.saving)
                if stops is None:
                    await _run(frames, log, task, request.saving["condition"])
                    return
                async with _link(address, DEBUG) as debug:
                    stepper = Stepper(debug, task, request.saving["body"], *stops)
                    if wrong := await stepper.prepare():
                        raise Failure(wrong)
                    await _run(frames, log, task, request.saving["condition"], stepper)


@contextlib.asynccontextmanager
async def _link(address: str, path: str) -> AsyncIterator[TextLink]:
    link = await TextLink.open(address, path)
    try:
        yield link
    finally:
        await link.close()


async def _ask(frames: TextLink, operate: str, *targets: str, **fields: str) -> TaskFrame:
    """Send a frame and return its answer, of a task unless ``type`` is given. Raises Failure for a refusal."""
    id = f"program_{operate}"
    frame = {"type": "task", "id": id, "operate": operate, "target_id": targets} | fields
    await frames.send(json.dumps(frame, ensure_ascii=False))
    async for text in frames:
        answer = json.loads(text)
        content: TaskFrame = answer.get("feedback") or answer["response"]
        if content["id"] == id:
            if content.get("state"):
                raise Failure(f"{operate}: {content['describe']} ({content['state']})")
            return content
    raise LinkLost("the robot went away")


async def _run(frames: TextLink, log: TextLink, task: str, condition: str, stepper: Stepper | None = None) -> None:
    """Run a task and show its blocks and prints to its end; an interruption ends it."""
    await _ask(frames, "run", task)
    if condition.strip() != "now":
        print(f"{task} waits for {condition}")
        return
    shown: set[str] = set()
    printing = asyncio.create_task(_follow_log(log, task, shown))
    try:
        error = await _follow_blocks(frames, task, stepper)
        await log.send("")  # its answer follows everything printed before
        await printing
    except asyncio.CancelledError:
        await _ask(frames, "shutdown", task)
        raise
    finally:
        printing.cancel()
    if error:
        raise Failure("" if error in shown else error)


async def _follow_blocks(frames: TextLink, task: str, stepper: Stepper | None = None) -> str:
    """Show begin and end of blocks; return the error that ended the program, "" for none."""
    error = ""
    async for text in frames:
        frame = json.loads(text)
        feedback = frame.get("feedback", {})
        if feedback.get("target_id") != task:
            continue
        if block := frame.get("block"):
            _show_block(block, feedback)
            continue
        if feedback["operate"] == "suspend":
            if feedback["id"].startswith("task_") and not await _halted(stepper):
                await _ask(frames, "shutdown", task)
                return "you ended it"
            continue
        match feedback["operate"]:
            case "start" | "run" if feedback["state"]:
                error = str(feedback["describe"])
                if feedback["operate"] == "start":
                    return error
            case "stop":
                return error
            case "shutdown":
                return "another client ended it"
    raise LinkLost("the robot went away")


async def _halted(stepper: Stepper | None) -> bool:
    """Show that the program halts; return False if the user ends it."""
    if stepper is not None:
        return await stepper.halted()
    print("‖ suspended", file=sys.stderr, flush=True)
    return True


def _show_block(block: TaskFrame, feedback: TaskFrame) -> None:
    sign = "▶" if block["type"] == "begin" else "■"
    trouble = f"  {feedback['describe']}" if feedback["state"] else ""
    print(visible(f"{sign} {block['id']}{trouble}"), file=sys.stderr, flush=True)


async def _known(frames: TextLink, task: str) -> bool:
    return any(known["id"] == task for known in (await _ask(frames, "inquiry"))["list"])


async def _print_log(log: TextLink, task: str, *, as_json: bool) -> int:
    """Print the stored log of a task; return the number of its entries."""
    if not as_json:
        return await _follow_log(log, task, times=True)
    lines: list[TaskFrame] = []
    async for text in log:
        line = json.loads(text)
        if "entries" in line:
            print(json.dumps(lines, ensure_ascii=False))
            return int(line["entries"])
        if line["target_id"] == task:
            lines.append({name: line[name] for name in ("at", "level", "text")})
    return 0


async def _follow_log(log: TextLink, task: str, errors: set[str] | None = None, *, times: bool = False) -> int:
    """Print lines of ``task`` up to the last; return the number of stored ones. Errors are added to ``errors``."""
    async for text in log:
        line = json.loads(text)
        if "entries" in line:
            return int(line["entries"])
        if line["target_id"] != task:
            continue
        if errors is not None and line["level"] == "error":
            errors.add(line["text"])
        if times:
            at = datetime.fromtimestamp(line["at"], UTC).strftime("%Y-%m-%d %H:%M:%S")
            print(f"{at} {line['level']:5} {visible(line['text'])}", flush=True)
        else:
            print(visible(line["text"]), file=sys.stdout if line["level"] == "print" else sys.stderr, flush=True)
    return 0


async def _list(address: str, frames: TextLink, kind: str, *, as_json: bool) -> None:
    """Print tasks or modules, with the resources of running ones."""
    listed: list[TaskFrame] = (await _ask(frames, "inquiry", type=kind))["list"]
    async with _link(address, RUNS) as link:
        await link.send("")
        running = {run["target_id"]: run for run in json.loads(await anext(aiter(link)))["runs"]}
    if kind == "task":
        for task in listed:
            task["run"] = running.get(task["id"])
    print(json.dumps(listed, ensure_ascii=False)) if as_json else _print_table(kind, listed)


def _print_table(kind: str, listed: list[TaskFrame]) -> None:
    from rich.console import Console
    from rich.table import Table

    figures = ("cpu", "memory", "age") if any(item.get("run") for item in listed) else ()
    table = Table(kind, "state", "mode", "condition", "modules", *figures, "describe", box=None)
    for item in listed:
        cells = [item["id"], item["operate"], item["mode"], item["condition"], " ".join(item["dependent"])]
        if figures:
            cells += _figures(item.get("run"))
        table.add_row(*map(visible, [*cells, item["describe"]]))
    Console(highlight=False, markup=False).print(table)


def _figures(run: TaskFrame | None) -> list[str]:
    """Return processor time, memory and age of a run, as text."""
    if run is None:
        return ["", "", ""]
    minutes, seconds = divmod(int(run["age"]), 60)
    hours, minutes = divmod(minutes, 60)
    return [f"{run['cpu']:.1f} s", f"{run['memory'] / 2**20:.0f} MB", f"{hours}:{minutes:02}:{seconds:02}"]


@contextlib.asynccontextmanager
async def own_robot(body: str, world: str, speed: float) -> AsyncIterator[str]:
    """Start a robot in this process with only the programs' WebSocket, on a free port; yield its address."""
    from roboglot.fleet import build_fleet
    from roboglot.model.clock import PatientClock
    from roboglot.programs.engine.engine import Engine
    from roboglot.programs.tasks.service import ProgramService
    from roboglot.protocols.visual.server import VisualDoor
    from roboglot.storage.database import Database
    from roboglot.storage.programs import program_stores

    engine = Engine()
    engine.open_soon()
    await asyncio.sleep(0)  # its process loads while we build the world
    database = Database(":memory:")  # nothing of it is kept: no disk to wait for
    robots = (RobotConfig(body=body),)
    fleet = build_fleet(world, robots, clock=PatientClock(speed), seed=1, database=database)
    robot = fleet.robots[robots[0].name]
    service = ProgramService(robot, engine, program_stores(database, robot.id))
    door = VisualDoor(service, "127.0.0.1", VisualConfig(port=0))
    closing: list[Coroutine[object, None, None]] = [fleet.close(), engine.close()]
    try:
        await fleet.start(wait=False)  # without waiting for compilation; skills that need it follow
        await door.start()
        closing.insert(0, door.close())
        yield door.endpoints[0].address.removesuffix(FRAMES)
    finally:
        for close in closing:
            await close
        database.close()
