"""``roboglot doctor``: what is missing on this machine, and how to get it."""

from __future__ import annotations

import asyncio
import os
import platform
import socket
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from roboglot.cli.checks.finding import Finding
from roboglot.cli.checks.listeners import holder_of
from roboglot.config import Config, load_config
from roboglot.extras import UP, installed
from roboglot.protocols import DOORS, sections


def command(
    data: Annotated[Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="The robot's data folder.")] = None,
    config: Annotated[Path | None, typer.Option(help="The TOML file of `roboglot up --config`.")] = None,
    security: Annotated[
        bool, typer.Option("--security", help="List listeners, who can reach them, rights and weak spots.")
    ] = False,
) -> None:
    """Check this machine; exit with 1 if a required part is missing."""
    try:
        settings = load_config(config, {"data": str(data) if data else None}, sections())
    except ValueError as error:
        sys.exit(f"roboglot doctor: {error}")
    if security:
        from roboglot.cli.checks.security import examine_security

        findings = list(examine_security(settings))
    else:
        findings = list(examine(settings))
    width = max(22, *(len(finding.name) for finding in findings))
    for finding in findings:
        print(f"{'ok  ' if finding.well else 'WEAK' if security else 'MISS'}  {finding.name:{width}} {finding.seen}")
        if not finding.well:
            print(f"      {'':{width}} -> {finding.remedy}")
    sys.exit(0 if all(finding.well for finding in findings) else 1)


def examine(config: Config) -> Iterator[Finding]:
    """Yield all checks, in the order of a start."""
    version = platform.python_version()
    yield Finding("Python", sys.version_info >= (3, 11), version, "install Python 3.11 or newer")
    yield Finding("Linux", sys.platform == "linux", sys.platform, "programs need Linux (seccomp); the rest may work")
    yield _data_folder(config.data)
    yield from examine_ports(config)
    there = installed()
    for extra in UP:
        seen = "installed" if there[extra] else "not installed"
        yield Finding(
            f"extra {extra}", there[extra], seen, f"pip install 'roboglot[{extra}]'; [up] brings all of these"
        )
    if there["programs"]:
        yield examine_sandbox()
    if there["simulation"]:
        yield _kernels()


def _data_folder(folder: Path) -> Finding:
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    return Finding(
        "data folder",
        nearest.is_dir() and os.access(nearest, os.W_OK),
        str(folder),
        "choose a folder you may write with --data",
    )


def examine_ports(config: Config) -> Iterator[Finding]:
    """Check that the first robot's ports are free, or held by a running roboglot."""
    address = config.robots[0].address
    for door in DOORS:
        for label, number in door.port_numbers(config).items():
            yield _port(f"{label} port", address, number)


def _port(name: str, address: str, port: int) -> Finding:
    place = f"{address}:{port}"
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
            return Finding(name, True, f"{place} is free")
        except OSError as error:
            holder = holder_of(address, port)
            if holder is None:
                return Finding(name, False, f"{place}: {error.strerror}", "choose another one with --address")
    if holder.is_roboglot:
        return Finding(name, True, f"{place} is served by {holder}")
    return Finding(name, False, f"{place} is held by {holder}", "stop that process, or use --address")


def examine_sandbox() -> Finding:
    """Check that users' programs can be confined."""
    from roboglot.programs.engine.engine import Engine, SandboxUnavailable

    async def layers() -> str:
        async with Engine() as engine:
            return ", ".join(engine.layers)

    try:
        return Finding("program sandbox", True, asyncio.run(layers()))
    except SandboxUnavailable as problem:
        return Finding(
            "program sandbox",
            False,
            str(problem),
            "block programs are refused (up --programs-without-filter runs trusted ones); the rest works",
        )


def _kernels() -> Finding:
    """Load the numeric kernels; compile missing ones."""
    from roboglot.kernels import MODULES
    from roboglot.kernels.ahead import KernelsUnavailable, compile_ahead

    began = time.perf_counter()
    try:
        compile_ahead(report=lambda name, done, total: print(f"      compiled kernel {done} of {total}: {name}"))
        for name in MODULES:
            import_module(f"roboglot.kernels.{name}")
    except (KernelsUnavailable, OSError) as error:
        return Finding("compiled kernels", False, str(error), "there is no mapping, navigation and camera until then")
    return Finding("compiled kernels", True, f"{len(MODULES)} loaded in {time.perf_counter() - began:.1f} s")
