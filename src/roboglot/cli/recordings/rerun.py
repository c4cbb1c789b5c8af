"""``roboglot rerun``: runs a recording's world again with the same inputs, and compares the traces."""

from __future__ import annotations

import asyncio
import dataclasses
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import visible

if TYPE_CHECKING:
    from roboglot.config import Config
    from roboglot.recording.inputs import Place
    from roboglot.recording.lines import Line
    from roboglot.recording.reader import Recording
    from roboglot.runtime import Runtime

NEW = "rerun.mcap"
BEGIN_MAX = 0.001  # s of robot time at which a recording begins at the latest
LOOPBACK = "127."
KEPT = "kept"  # the fact "data" of a recording whose robots had stored things when they started


class NoRerun(ValueError):
    """The recording cannot be run again; the message says why."""


def command(
    file: Annotated[Path, typer.Argument(help="A recording of roboglot up --lockstep --record.")],
    keep: Annotated[Path | None, typer.Option(help="Keep the recording of the rerun in this file.")] = None,
) -> None:
    """Run a lockstep recording again, with its configuration, seed and inputs; exit with 1 at the first difference."""
    from roboglot.recording.reader import read_recording
    from roboglot.recording.traces import difference

    with tempfile.TemporaryDirectory(prefix="roboglot-rerun-") as folder:
        try:
            recording = read_recording(file)
            config = configuration(recording, Path(folder))
            unheard = asyncio.run(run(recording, config))
            verdict = difference(file, Path(folder) / NEW)
        except (OSError, ValueError) as error:
            print(f"roboglot rerun: {visible(in_words(error))}", file=sys.stderr)
            raise typer.Exit(2) from None
        if keep is not None:
            shutil.copy(Path(folder) / NEW, keep)
    for request in unheard:
        print(f"not repeated: {visible(request)}")
    if verdict.difference is None:
        print(f"identical: {verdict.agreed} messages, {recording.seconds:.1f} s")
        raise typer.Exit(0)
    found = verdict.difference
    print(f"{verdict.agreed} messages agree; then {found.topic} differs")
    for line in found.before:
        print(f"  {visible(line)}")
    print(f"- {visible(found.recorded)}\n+ {visible(found.now)}")
    for reason in reasons(recording):
        print(f"Possible reason: {reason}")
    raise typer.Exit(1)


def configuration(recording: Recording, folder: Path) -> Config:
    """Return the recording's configuration, for a rerun with its data in ``folder``. Raises NoRerun."""
    from msgspec import DecodeError, convert

    from roboglot.config import ConsoleConfig, config_of
    from roboglot.protocols import sections
    from roboglot.validation import decode_json

    clock = recording.facts.get("clock", "")
    if clock != "lockstep":
        raise NoRerun(f"{recording.path} was recorded on a running clock ({clock}), so a second run would differ")
    try:
        values = decode_json(recording.attachments["config.json"], dict[str, object])
        of_doors, at = convert((values.pop("doors", {}), values["world"]), tuple[dict[str, object], str])
    except (KeyError, DecodeError):
        raise NoRerun(f"{recording.path} lacks its configuration") from None
    for name, data in recording.attachments.items():  # world and bodies as they were then
        (folder / Path(name).name).write_bytes(data)
    values |= of_doors | {"data": str(folder / "data")}
    if (world := folder / Path(at).name).suffix and world.exists():
        values["world"] = str(world)
    config = config_of(values, doors=sections(), origin=str(recording.path))
    if why := _why_not(recording, config):
        raise NoRerun(why)
    record = dataclasses.replace(config.record, to=str(folder / NEW), ring=False)
    console, doors = ConsoleConfig(enabled=False), _alone(config.doors, folder)
    return dataclasses.replace(config, record=record, console=console, database="", registry="", doors=doors)


def _why_not(recording: Recording, config: Config) -> str:
    """Return why the recording cannot be run again; empty if it can."""
    if config.access.on:
        return "clients signed in, and the recording does not contain their tokens"
    if any(not robot.is_simulated for robot in config.robots):
        return "it has a real or recorded robot; only simulated robots can be run again"
    if getattr(config.doors.get("vda5050"), "broker", ""):
        return "fleet control (VDA 5050) used a broker, whose messages are not in the recording"
    if getattr(config.doors.get("visual"), "cloud", ""):
        return "the answers of the cloud of block programs are not in the recording"
    late = recording.first / 1e9 - recording.epoch
    if recording.epoch and late > BEGIN_MAX:
        return f"{recording.path} begins {late:.1f} s after its robots, and what happened before is not in it"
    return ""


def _alone(doors: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Return the doors' settings for an isolated rerun: no ROS 2 routers, serial lines in ``folder``."""
    own = dict(doors)
    if (ros2 := doors.get("ros2")) is not None:
        own["ros2"] = dataclasses.replace(ros2, connect=())
    if (text := doors.get("robomaster")) is not None and text.uart:
        own["robomaster"] = dataclasses.replace(text, uart=str(folder / "uart"))
    return own


def reasons(recording: Recording) -> list[str]:
    """Return, as text, the inputs of a recording that a rerun cannot repeat."""
    from roboglot.model.tap import Direction
    from roboglot.recording.secrets import REDACTED

    found = []
    if recording.facts.get("data", "") == KEPT:
        found.append("the robots had a data folder from before, and its maps, programs and settings are not recorded")
    redacted = sum(REDACTED in e.payload for e in recording.exchanges if e.direction is Direction.REQUEST)
    redacted += sum(REDACTED.decode() in str(given.values) for _, given in recording.inputs)
    if redacted:
        found.append(f"{redacted} requests hold [redacted] where passwords, names or the like stood")
    return found


async def run(recording: Recording, config: Config) -> list[str]:
    """Run it, recorded as configured; return the inputs without effect. Raises OSError for a taken address."""
    from roboglot.cli.recordings.repeating import Repeater
    from roboglot.model.clock import LockstepClock
    from roboglot.recording.inputs import Inputs
    from roboglot.runtime import Runtime

    runtime = Runtime(config)
    assert isinstance(runtime.clock, LockstepClock)
    repeat = Repeater(runtime)
    inputs = Inputs(recording, runtime.clock, lambda place: _line(runtime, place), repeat)
    for robot in runtime.fleet.robots.values():
        robot.tap.listen(inputs.count)
        robot.inputs.listen(inputs.notice)
    try:
        await runtime.start()
        start = recording.epoch or runtime.clock.epoch() - runtime.clock.time()
        await inputs.play((recording.last - round(start * 1e9)) / 1e9)
    finally:
        await runtime.close()  # as then: clients that did not hang up are still there
        await inputs.close()
    return inputs.unheard


def _line(runtime: Runtime, place: Place) -> Line | None:
    """Return a connection to a door, by its own port; None if clients of its kind cannot be repeated."""
    from roboglot.cli.recordings.repeating import Ros2Line, SerialTextLine
    from roboglot.model.clock import RealClock
    from roboglot.protocols.robomaster.ports.serial_line import SERIAL
    from roboglot.recording.lines import LINES, PORTS, DogLine, FoxgloveLine

    config, (robot, door, client) = runtime.config, place
    host = next(one.address for one in config.robots if one.name == robot)
    section = config.doors.get(door)
    if door == "ros2":
        return Ros2Line(runtime.doors[robot])
    if door == "robomaster" and client.startswith(SERIAL):
        return SerialTextLine(Path(f"{getattr(section, 'uart', '')}-{robot}"))
    kind: type[Line] | None = FoxgloveLine if door == "foxglove" else LINES.get(door)
    if kind is None:
        return None
    port = getattr(section, "control_port" if door == "robomaster" else "port", PORTS.get(door, 0))
    line = kind(host, port, RealClock(), lambda _operation, _data: None)
    if client.startswith(LOOPBACK):  # pushes go to each host with a client
        line.own = client.rpartition(":")[0]
    if isinstance(line, DogLine):  # no app: its answers are in the recording
        line.options = {} if getattr(section, "plaintext", False) else {"certs": str(_certificates(config))}
    return line


def _certificates(config: Config) -> Path:
    """Return the folder with an app's certificates."""
    from roboglot.protocols.cyberdog.certificates import export_client
    from roboglot.protocols.cyberdog.pem_files import FOLDER

    folder = config.data / "app"
    if not folder.exists():
        export_client(config.data / FOLDER, folder)
    return folder
