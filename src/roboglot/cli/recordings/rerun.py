"""``roboglot rerun``: the world of a recording once more, with the same inputs, and whether all of it is the same."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboglot.hosting.visible import visible

if TYPE_CHECKING:
    from roboglot.config import Config
    from roboglot.recording.lines import Line
    from roboglot.recording.reader import Recording
    from roboglot.runtime import Runtime

NEW = "rerun.mcap"


class NoRerun(ValueError):
    """The recording cannot be run again; the message says why."""


def command(
    file: Annotated[Path, typer.Argument(help="A recording of roboglot up --lockstep --record.")],
    keep: Annotated[Path | None, typer.Option(help="Keep the recording of the rerun in this file.")] = None,
) -> None:
    """Run a lockstep recording again: same configuration, seed and inputs; exits with 1 at the first difference."""
    from roboglot.recording.reader import read_recording
    from roboglot.recording.traces import difference

    with tempfile.TemporaryDirectory(prefix="roboglot-rerun-") as folder:
        try:
            recording = read_recording(file)
            config = configuration(recording, Path(folder))
            unheard = asyncio.run(run(recording, config))
            verdict = difference(file, Path(folder) / NEW)
        except (OSError, ValueError) as error:
            print(f"roboglot rerun: {visible(str(error))}", file=sys.stderr)
            raise typer.Exit(2) from None
        if keep is not None:
            shutil.copy(Path(folder) / NEW, keep)
    for request in unheard:
        print(f"not heard: {visible(request)}")
    if verdict.difference is None:
        print(f"identical: {verdict.agreed} messages, {recording.seconds:.1f} s")
        raise typer.Exit(0)
    found = verdict.difference
    print(f"{verdict.agreed} messages agree; then {found.topic} differs")
    for line in found.before:
        print(f"  {visible(line)}")
    print(f"- {visible(found.recorded)}\n+ {visible(found.now)}")
    raise typer.Exit(1)


def configuration(recording: Recording, folder: Path) -> Config:
    """Return what the recording was started with, for a rerun with its data in ``folder``. Raises NoRerun."""
    from roboglot.config import ConsoleConfig, config_of
    from roboglot.protocols import sections

    clock = recording.facts.get("clock", "")
    if clock != "lockstep":
        raise NoRerun(f"{recording.path} was recorded on a running clock ({clock}), of which no second run is the same")
    try:
        values: dict[str, Any] = json.loads(recording.attachments["config.json"])
    except (KeyError, ValueError):
        raise NoRerun(f"{recording.path} says nothing of its configuration") from None
    for name, data in recording.attachments.items():  # world and bodies as they were then
        (folder / Path(name).name).write_bytes(data)
    values |= values.pop("doors", {}) | {"data": str(folder / "data")}
    if (world := folder / Path(values["world"]).name).suffix and world.exists():
        values["world"] = str(world)
    config = config_of(values, doors=sections(), origin=str(recording.path))
    if config.access.on:
        raise NoRerun("who was let in by name cannot come in again: the recording has no tokens")
    if any(not robot.is_simulated for robot in config.robots):
        raise NoRerun("real and recorded robots do not live in a world that could be run again")
    record = dataclasses.replace(config.record, to=str(folder / NEW), ring=False)
    return dataclasses.replace(config, record=record, console=ConsoleConfig(enabled=False))


async def run(recording: Recording, config: Config) -> list[str]:
    """Run it, recorded as configured; returns the inputs that were not heard. Raises OSError for a taken address."""
    from roboglot.cli.recordings.repeating import Repeater
    from roboglot.model.clock import LockstepClock
    from roboglot.recording.inputs import Inputs
    from roboglot.runtime import Runtime

    runtime = Runtime(config)
    assert isinstance(runtime.clock, LockstepClock)
    repeat = Repeater(runtime)
    inputs = Inputs(recording, runtime.clock, lambda robot, door: _line(runtime, robot, door), repeat)
    for robot in runtime.fleet.robots.values():
        robot.tap.listen(inputs.hear)
    try:
        await runtime.start()
        start = recording.epoch or runtime.clock.epoch() - runtime.clock.time()
        await inputs.play((recording.last - round(start * 1e9)) / 1e9)
    finally:
        await runtime.close()
    return inputs.unheard


def _line(runtime: Runtime, robot: str, door: str) -> Line:
    """Return a connection to a door, by its own port."""
    from roboglot.recording.lines import LINES, PORTS, DogLine

    config = runtime.config
    host = next(one.address for one in config.robots if one.name == robot)
    section = config.doors.get(door)
    port = getattr(section, "control_port" if door == "robomaster" else "port", PORTS[door])
    from roboglot.model.clock import RealClock

    line = LINES[door](host, port, RealClock(), lambda _operation, _data: None)
    if isinstance(line, DogLine) and getattr(section, "plaintext", False):
        line.options = {}
    elif isinstance(line, DogLine):
        from roboglot.protocols.cyberdog.certificates import export_client
        from roboglot.protocols.cyberdog.server import FOLDER

        folder = config.data / "app"
        if not folder.exists():
            export_client(config.data / FOLDER, folder)
        line.options = {"certs": str(folder)}  # no app: its answers are in the recording
    return line
