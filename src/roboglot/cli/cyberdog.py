"""``roboglot cyberdog``: look at a CyberDog 2 and move it from the terminal, a real one or ours."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import secrets
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated, BinaryIO

import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from roboglot.cli.screen import shortened
from roboglot.clients.cyberdog import Certificates, CyberDogClient, CyberDogRefused, Heartbeat
from roboglot.clients.cyberdog.chapters.camera.camera import CameraFile
from roboglot.clients.cyberdog.values import Grid
from roboglot.clients.errors import ClientError
from roboglot.config import load_config
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import in_line
from roboglot.spelling import instead
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.cyberdog.codes import Feedback

NAMES = ("watch", "status", "stand", "lie", "drive", "map", "go", "charge", "photo", "record", "stop")
WORDS_MAX = {"drive": 4, "map": 1, "go": 3, "photo": 1, "record": 2}  # other commands take none
OPTIONS = ("--robot", "--certs", "--data", "--plaintext", "--app-port", "--help")
UNTRUSTED = "CERTIFICATE_VERIFY_FAILED"  # in gRPC's words
LINE_PERIOD = 0.5  # s between two lines
FIRST_MAX = 20.0  # s before a map must begin to grow
Work = Callable[[CyberDogClient, list[str]], Awaitable[None]]
SETTINGS = {"ignore_unknown_options": True}  # numbers may be negative
console = Console(highlight=False)


def command(
    what: Annotated[str, typer.Argument(help=" · ".join(NAMES))],
    words: Annotated[list[str] | None, typer.Argument(help="Arguments of the command; see above.")] = None,
    robot: Annotated[str, typer.Option(envvar="ROBOGLOT_CYBERDOG", help="The dog's address.")] = "127.0.0.1",
    certs: Annotated[Path | None, typer.Option(help="Folder with the client's certificates.")] = None,
    data: Annotated[
        Path | None,
        typer.Option(envvar="ROBOGLOT_DATA", help="Data folder whose certificates are used without --certs."),
    ] = None,
    plaintext: Annotated[bool, typer.Option("--plaintext", help="Connect without TLS.")] = False,
    app_port: Annotated[int, typer.Option(min=0, max=65535, help="The port that the robot calls.")] = 8981,
) -> None:
    """Talk to a CyberDog 2 as its phone app does.

    drive X Y YAW SECONDS (m/s, rad/s) · go X Y [THETA] (m, rad) · map NAME · photo [FILE] · record SECONDS [FILE]
    """
    if what not in WORK:
        sys.exit(f"roboglot cyberdog: {what!r} is not one of {', '.join(WORK)}")
    if fault := _fault(what, words or []):
        sys.exit(f"roboglot cyberdog: {fault}")
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")  # a failed handshake is reported below
    folder = certs or _own(data)
    try:
        proof = None if plaintext else Certificates.load(folder)
    except OSError as error:
        sys.exit(f"roboglot cyberdog: no certificates: {in_words(error)}; `roboglot certs --export DIR` writes them")
    try:
        asyncio.run(_at(CyberDogClient(robot, proof, app_port=app_port), WORK[what], words or []))
    except (ClientError, OSError, ValueError) as error:  # a TimeoutError has no text
        sys.exit(f"roboglot cyberdog: {_why(in_words(error), robot, folder)}")
    except KeyboardInterrupt:
        sys.exit(130)


def _fault(what: str, words: list[str]) -> str:
    """Return why these are not words of the command: a mistyped --robot must not move another one. "" if they are."""
    for word in words:
        if word.startswith("-") and not _is_number(word):
            return f"there is no option {word!r}{instead(word.partition('=')[0], OPTIONS)}"
    most = WORDS_MAX.get(what, 0)
    if len(words) > most:
        count = "no words" if not most else "at most 1 word" if most == 1 else f"at most {most} words"
        return f"{what} takes {count}, not {' '.join(words)!r}"
    return ""


def _why(words: str, robot: str, folder: Path) -> str:
    if UNTRUSTED in words:
        return (
            f"the robot at {robot} has other certificates than {folder}: give --data the folder of its `roboglot up`, "
            "or --certs that of its `roboglot certs --export`"
        )
    return words or "nothing came in time"


def _own(data: Path | None) -> Path:
    return load_config(None, {"data": str(data) if data else None}).data / "cyberdog" / "tls"


async def _at(client: CyberDogClient, work: Work, words: list[str]) -> None:
    async with client:
        await work(client, words)


def _numbers(words: list[str], least: int, most: int) -> list[float]:
    if not least <= len(words) <= most:
        raise ValueError(f"it takes {least}{f' to {most}' if most > least else ''} numbers, not {len(words)}")
    numbers = [float(word) for word in words]
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{' '.join(words)}: not all of these are finite numbers")
    return numbers


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _print_feedback(code: int) -> None:
    known = code in tuple(Feedback)
    console.print(f"{code} {Feedback(code).name.lower().replace('_', ' ') if known else ''}")


async def _watch(client: CyberDogClient, _: list[str]) -> None:
    """Show the heartbeat, live, until interrupted."""
    await client.found()
    with Live(console=console, auto_refresh=False) as live:
        while True:
            if client.heartbeat:
                live.update(_table(client.heartbeat, client.connected), refresh=True)
            await asyncio.sleep(LINE_PERIOD)


def _table(heartbeat: Heartbeat, connected: bool) -> Table:
    title = f"{heartbeat.serial} at {heartbeat.ip}{'' if connected else ' (lost)'}"
    table = Table(title=Text(in_line(title)), show_header=False)
    charging = "wired" if heartbeat.wired_charging else "docked" if heartbeat.wireless_charging else "no"
    for name, value in (
        ("battery", f"{heartbeat.battery} %, charging: {charging}"),
        ("Wi-Fi", f"{heartbeat.wifi_strength} %"),
        ("motion", str(heartbeat.motion_id)),
        ("task", f"{heartbeat.task_status}, feedback {heartbeat.task_sub_status}"),
        ("state", str(heartbeat.state)),
        ("self-check", f"{heartbeat.self_check} {shortened(heartbeat.self_check_description, 80)}"),
    ):
        table.add_row(name, Text(in_line(value)))  # no markup
    return table


async def _status(client: CyberDogClient, _: list[str]) -> None:
    console.print_json(data={**await client.information(), **await client.status()})


async def _stand(client: CyberDogClient, _: list[str]) -> None:
    await client.stand()


async def _lie(client: CyberDogClient, _: list[str]) -> None:
    await client.lie_down()


async def _stop(client: CyberDogClient, _: list[str]) -> None:
    """Stand still and end all tasks."""
    await client.end_servo()
    with contextlib.suppress(CyberDogRefused):
        await client.stop_task()


async def _drive(client: CyberDogClient, words: list[str]) -> None:
    x, y, yaw, seconds = _numbers(words, 4, 4)
    _check_seconds(seconds)
    async with client.servo(Motion.TROT_MEDIUM) as joystick:
        joystick.set(x, y, yaw)
        await client.clock.sleep(seconds)


async def _map(client: CyberDogClient, words: list[str]) -> None:
    """Map until a line on standard input; the dog is driven from elsewhere meanwhile."""
    if len(words) != 1:
        raise ValueError("it takes the map's name")
    await client.found()
    await _stop(client, [])  # a localized robot does not begin a map
    task = await client.map_surroundings(on_feedback=_print_feedback)
    console.print("mapping; drive about, then press Enter to save")
    begun = asyncio.Event()
    growing = asyncio.ensure_future(_growth(client, begun))
    try:
        await asyncio.to_thread(sys.stdin.readline)
        await asyncio.wait_for(begun.wait(), FIRST_MAX)  # nothing can be saved before
        await client.save_map(words[0])
    finally:
        growing.cancel()
        task.leave()
    console.print(f"saved as {words[0]}")


async def _growth(client: CyberDogClient, begun: asyncio.Event) -> None:
    with client.watch(Grid) as grids:
        async for grid in grids:
            if grid.data:
                begun.set()
            known = sum(cell >= 0 for cell in grid.data) * grid.resolution**2
            console.print(f"{grid.width} x {grid.height} cells, {known:.1f} m² known")


async def _go(client: CyberDogClient, words: list[str]) -> None:
    """Localize the dog, then navigate to the goal."""
    goal = _numbers(words, 2, 3)
    await client.found()
    with contextlib.suppress(CyberDogRefused):  # already localized, or navigation will report the problem
        await (await client.relocalise(on_feedback=_print_feedback))
    task = await client.navigate(*goal, on_feedback=_print_feedback)
    try:
        await task
    except asyncio.CancelledError:
        await task.cancel()
        raise


async def _charge(client: CyberDogClient, _: list[str]) -> None:
    await client.found()
    await (await client.charge(on_feedback=_print_feedback))


async def _photo(client: CyberDogClient, words: list[str]) -> None:
    await _receive(_writable(words), lambda file: client.photo(into=file))


async def _record(client: CyberDogClient, words: list[str]) -> None:
    (seconds,) = _numbers(words[:1], 1, 1)
    _check_seconds(seconds)
    name = _writable(words[1:])
    await client.found()  # a dog still looking for its previous app would end the recording
    await client.record()
    await client.clock.sleep(seconds)
    await _receive(name, lambda file: client.stop_recording(into=file))


def _check_seconds(seconds: float) -> None:
    if seconds <= 0.0:
        raise ValueError(f"SECONDS is above 0, not {seconds:g}")


def _writable(words: list[str]) -> str:
    """Return the file's name, if one is given. Raises OSError: the robot deletes what it has sent."""
    for name in words:
        if Path(name).is_dir() or not os.access(Path(name).parent, os.W_OK):
            raise OSError(f"cannot write {name}")
    return "".join(words)


def _here(name: str) -> str:
    """Return the robot's name for a file as one of this folder, whatever a hostile robot calls it. Raises OSError."""
    last = name.replace("\\", "/").rpartition("/")[2]
    if last.startswith(".") or not last.isprintable() or not last or Path(last).exists():
        raise OSError(f"the robot calls the file {name!r}: name one for it")
    return last


def _place_of(name: str) -> Path | None:
    """Return where a file of this name goes, through links; None without a name."""
    return Path(os.path.realpath(name)) if name else None


async def _receive(name: str, fetch: Callable[[BinaryIO], Awaitable[CameraFile]]) -> None:
    """Receive a file beside its place, and move it there when it is whole; one that fails leaves nothing.

    ``name`` empty: it gets the robot's in this folder.
    """
    place = _place_of(name)
    if place is not None and place.exists() and not place.is_file():  # a pipe or a device
        with place.open("wb") as file:
            found = await fetch(file)
    else:
        part = (place.parent if place is not None else Path()) / f".roboglot-{secrets.token_hex(8)}.part"
        try:
            with part.open("xb") as file:
                found = await fetch(file)
            part.replace(place or Path(name := _here(found.name)))
        finally:
            part.unlink(missing_ok=True)
    console.print(f"{name}: {found.size} bytes", markup=False)


_WORKS: tuple[Work, ...] = (
    _watch, _status, _stand, _lie, _drive, _map, _go, _charge, _photo, _record, _stop,
)  # fmt: skip
WORK: dict[str, Work] = dict(zip(NAMES, _WORKS, strict=True))
