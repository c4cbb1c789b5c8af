"""Record a running program, mark moments; show and repair recordings.

`roboglot record URL --listen ADDRESS` records a real robot, as a proxy between it and its client.
"""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import sys
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboglot.cli.control import running
from roboglot.cli.suggestions import Group
from roboglot.config import default_data_folder
from roboglot.control.record_server import NAME, Answer, Request
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import in_line
from roboglot.hosting.event_loop import run

SWITCH = 0.0002  # s that the writing thread may hold the interpreter's lock; Python's own 5 ms delay messages
PATIENCE = 30.0  # s: a long ring takes a while to write
EPILOG = "A URL instead of a command records a real robot: roboglot record slamware://192.168.11.1 --listen 127.0.0.9"


class _Commands(Group):
    """Group in which a URL in place of a command means ``proxy``."""

    def parse_args(self, ctx: Context, args: list[str]) -> list[str]:
        """Insert the command's name before a URL."""
        return super().parse_args(ctx, ["proxy", *args] if args and "://" in args[0] else args)


app = typer.Typer(
    cls=_Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help=__doc__,
    epilog=EPILOG,
)
if TYPE_CHECKING:
    from typer._click.core import Context

    from roboglot.recording.lines import Target
    from roboglot.recording.proxy.dog import DogRelay
    from roboglot.recording.proxy.relay import ExchangeWriter, Relay

Data = Annotated[Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="The folder that `roboglot up` uses.")]


@app.command()
def start(
    path: Annotated[Path, typer.Argument(help="New file, or a folder for it.")] = Path("."),
    data: Data = None,
) -> None:
    """Start to record all robots of the running program."""
    _show(_ask(data, Request("start", str(path.absolute()) + ("/" if path.is_dir() else ""))))


@app.command()
def stop(data: Data = None) -> None:
    """End the recording."""
    answer = _ask(data, Request("stop"))
    print(f"recorded {answer.seconds:.1f} s, {answer.entries} values, {answer.bytes} bytes: {answer.path}")
    _complain(answer)


@app.command()
def mark(text: Annotated[str, typer.Argument(help="Text of the remark.")], data: Data = None) -> None:
    """Put a remark into the recording at this moment."""
    _ask(data, Request("mark", text))


@app.command()
def save(path: Annotated[Path, typer.Argument(help="New file to write.")], data: Data = None) -> None:
    """Write the last minutes that --record-ring keeps."""
    _ask(data, Request("save", str(path.absolute())))
    print(f"the last minutes are in {path}")


@app.command()
def status(data: Data = None) -> None:
    """Show the progress of the recording."""
    _show(_ask(data, Request()))


@app.command()
def proxy(
    url: Annotated[
        str,
        typer.Argument(help="A robot: slamware://, robomaster://, visual://HOST[:PORT], cyberdog://HOST?certs=DIR."),
    ],
    listen: Annotated[str, typer.Option(help="Address of this machine for the client to connect to.")],
    to: Annotated[Path, typer.Option(help="New file for the recording.")] = Path("robot.mcap"),
    redact: Annotated[list[str] | None, typer.Option(help="Field whose values are left out; repeat for more.")] = None,
    photos: Annotated[bool, typer.Option("--photos", help="Keep photos and films that the client fetches.")] = False,
    data: Data = None,
) -> None:
    """Pass every byte between a client and a robot, and record the messages, until Ctrl-C."""
    from roboglot.recording.lines import Target
    from roboglot.recording.proxy.relay import ExchangeWriter, Relay

    if to.exists():
        sys.exit(f"roboglot record: {to} exists already; --to names a new file")
    writer: ExchangeWriter | None = None
    try:
        target = Target(url)
        writer = ExchangeWriter(to, target, metadata.version("roboglot"), redact=redact or (), photos=photos)
        relay = _dog_relay(target, listen, writer, data) if target.door == "cyberdog" else Relay(target, listen, writer)
        run(_pass(relay, f"{listen} passes everything to {url} and back; it is recorded in {to}"))
    except (OSError, ValueError) as error:
        if writer is not None:  # nothing has passed
            writer.close()
            to.unlink(missing_ok=True)
        sys.exit(f"roboglot record: {in_words(error)}")
    writer.close()
    if writer.thread.failure:
        sys.exit(f"roboglot record: the recording ended early: {writer.thread.failure}")
    print(f"{writer.files.written} messages are in {to}")
    if delays := relay.watch.summary():
        print(delays)


def _dog_relay(target: Target, listen: str, writer: ExchangeWriter, data: Path | None) -> DogRelay:
    """Return a relay that has our certificates of the data folder towards the app. Raises OSError, ValueError."""
    from roboglot.protocols.cyberdog.certificates import ensure_certificates
    from roboglot.protocols.cyberdog.pem_files import FOLDER
    from roboglot.recording.proxy.dog import DogRelay, Proof

    if "certs" not in target.options:
        raise ValueError("a CyberDog requires a certificate: cyberdog://HOST?certs=FOLDER, or none for plain gRPC")
    if target.options["certs"] == "none":
        return DogRelay(target, listen, writer, None)
    own = ensure_certificates((data or default_data_folder(os.environ)) / FOLDER)
    return DogRelay(target, listen, writer, Proof(own.certificate, own.key, own.callers))


async def _pass(relay: Relay | DogRelay, words: str) -> None:
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    await relay.open()
    sys.setswitchinterval(SWITCH)
    gc.freeze()  # what is loaded stays: no collection need walk it again
    print(words, flush=True)
    await stop.wait()
    await relay.close()


@app.command()
def info(
    file: Annotated[Path, typer.Argument(help="A recording.")],
    check: Annotated[bool, typer.Option("--check", help="Read every message, to find damage.")] = False,
) -> None:
    """Show the contents of a recording, from its index; without one, or with --check, by reading every message."""
    from roboglot.recording.message_index import read_outline
    from roboglot.recording.reader import BadRecording, read_recording

    try:
        recording = read_recording(file) if check else read_outline(file)
    except (OSError, BadRecording) as error:
        sys.exit(f"roboglot record: {in_words(error)}")
    for name, value in recording.facts.items():
        print(in_line(f"{name:10} {value}"))
    print(f"{'seconds':10} {recording.seconds:.1f}{'' if recording.whole else '  (incomplete: see repair)'}")
    for name, count in sorted(recording.topics.items()):
        print(in_line(f"{count:10} {name}"))
    for name, data in recording.attachments.items():
        print(in_line(f"{'file':10} {name}, {len(data)} bytes"))


@app.command()
def repair(
    file: Annotated[Path, typer.Argument(help="A recording without its end.")],
    to: Annotated[Path, typer.Argument(help="New file for the repaired recording.")],
) -> None:
    """Copy the readable part of a recording whose program was killed into a complete file with an index."""
    from roboglot.recording.reader import BadRecording
    from roboglot.recording.repair import mend

    try:
        count = mend(file, to)
    except (OSError, BadRecording) as error:
        sys.exit(f"roboglot record: {in_words(error)}")
    print(f"{count} messages are in {to}")


def _ask(data: Path | None, request: Request) -> Answer:
    folder = data or default_data_folder(os.environ)
    return running.request("record", folder / NAME, request, Answer, PATIENCE)


def _show(answer: Answer) -> None:
    if answer.failure:
        print(f"recorded to {answer.path}: {answer.entries} values, {answer.bytes} bytes; nothing more is written")
    elif answer.on:
        print(f"recording to {answer.path}: {answer.seconds:.1f} s, {answer.entries} values, {answer.bytes} bytes")
    else:
        print("no recording is under way")
    if answer.ring:
        print("the last minutes are in memory; `roboglot record save FILE` writes them")
    _complain(answer)


def _complain(answer: Answer) -> None:
    if answer.failure:
        sys.exit(f"roboglot record: the recording ended: {answer.failure}; {answer.dropped} values since then are lost")
    if answer.dropped:
        print(f"{answer.dropped} values were dropped: the disk was too slow", file=sys.stderr)
