"""``roboglot demo``: four independent clients drive one robot, and a picture of their tracks."""

from __future__ import annotations

import asyncio
import os
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from roboglot.cli.checks.listeners import holder_of
from roboglot.config import Config
from roboglot.extras import MODULES, refuse_without
from roboglot.protocols import DOORS
from roboglot.testing.process import NotUp


def command(
    world: Annotated[str, typer.Option(help="A shipped world, a .toml of yours, or a ROS map (.yaml).")] = "office",
    address: Annotated[str, typer.Option(help="Address of the demo's robot.")] = "127.0.0.1",
    out: Annotated[Path, typer.Option(help="The picture to draw.")] = Path("tour.png"),
    speed: Annotated[float, typer.Option(help="Robot seconds per real second.")] = 1.0,
) -> None:
    """Let four independent clients drive the same robot, one after the other; all four print its pose."""
    refuse_without("roboglot demo", "demo", MODULES["demo"])
    if problem := _obstacle(address, out):
        sys.exit(f"roboglot demo: {problem}")
    os.environ.setdefault("GRPC_VERBOSITY", "ERROR")  # gRPC need not report that a robot hung up
    try:
        _compile_kernels()
        sys.exit(asyncio.run(_demo(world, address, out, speed)))
    except (TimeoutError, ConnectionError, NotUp) as error:
        sys.exit(f"roboglot demo: {str(error) or 'the robot did not answer in time'}")
    except KeyboardInterrupt:
        sys.exit(130)


def _compile_kernels() -> None:
    """Compile missing kernels before the tour, so that it does not wait for them on its way."""
    from roboglot.kernels.ahead import KernelsUnavailable, compile_ahead

    def report(name: str, done: int, total: int) -> None:
        print(f"compiled kernel {done} of {total}: {name}", flush=True)

    try:
        compile_ahead(report=report)
    except KernelsUnavailable as error:
        sys.exit(f"roboglot demo: {error}")


def _obstacle(address: str, out: Path) -> str:
    """Return what would prevent the tour; empty: nothing."""
    try:
        existed = out.exists()
        out.open("ab").close()
        if not existed:
            out.unlink()
    except OSError as error:
        return f"{out} cannot be written: {error.strerror}; choose another file with --out"
    for port in (port for door in DOORS for port in door.port_numbers(Config()).values()):
        if holder := holder_of(address, port):
            return f"{address}:{port} is taken by {holder}; stop it, or choose another place with --address 127.0.0.2"
    return ""


async def _demo(world: str, address: str, out: Path, speed: float) -> int:
    from roboglot.demo.clients.phone import Phone
    from roboglot.demo.tour import Tour
    from roboglot.protocols.cyberdog.certificates import ensure_certificates, export_client
    from roboglot.testing.process import served

    with tempfile.TemporaryDirectory(prefix="roboglot-demo-") as folder:
        data = Path(folder) / "data"
        ensure_certificates(data / "cyberdog")
        export_client(data / "cyberdog", Path(folder) / "certificates")
        phone = Phone(address, Path(folder) / "certificates")
        await phone.open()
        try:
            print(f"starting a robot in the world {world} on {address} …", flush=True)
            arguments = ("--world", world, "--speed", str(speed), "--app", f"127.0.0.1:{phone.port}")
            with served(data, *arguments, address=address) as robot:
                print(f"ready after {robot.ready_after:.1f} s", flush=True)
                tour = Tour(address, phone, lambda line: print(line, flush=True))
                try:
                    agreed = await tour.run()
                    await tour.picture(out, f"roboglot · {Path(world).stem}")
                finally:
                    await tour.close()
        finally:
            await phone.close()
    print(f"\nthe map and the four tracks are in {out}")
    return 0 if agreed else 1
