"""Serves a fleet in the foreground: starts it, answers commands and pages, and ends it in order at a signal."""

from __future__ import annotations

import asyncio
import logging
import signal
import time
from collections.abc import Callable

from roboglot.shards.classes import FleetClasses
from roboglot.shards.command_server import CommandServer
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.folder_before import FolderBefore
from roboglot.shards.overview import Overview
from roboglot.shards.states import State

log = logging.getLogger(__name__)


class NoWorld(ValueError):
    """The settings of every world are wrong."""


class Interrupted(Exception):
    """A signal came before the worlds were up."""


async def serve(
    fleet_host: Callable[[], FleetHost],
    before: FolderBefore,
    say: Callable[[str], None],
    began: float,
    *,
    lasting: bool,
) -> None:
    """Keep the fleet up until a signal; ``say`` once a world is. Raises NoWorld, Interrupted, OSError.

    A new plan is kept once the worlds are up, or when shards outlive this program (``lasting``); before, ``before`` is
    brought back.
    """
    host = fleet_host()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, _end, host.ended)
    commands, classes = CommandServer(host, before.folder), FleetClasses(before.folder)
    page = Overview(host, _first_address(host))
    before.is_kept = keep = lasting
    await classes.open()  # shards look for this socket when they start
    starting = asyncio.ensure_future(_until_up(host))
    try:
        await commands.open()
        await _either(host.ended, starting)
        if not starting.done():
            host.ended.result()
            before.is_kept = lasting or _have_been_up(host)
            raise Interrupted(f"interrupted before all worlds were up{'; those that were started go on' * lasting}")
        before.is_kept = keep = keep and not isinstance(starting.exception(), NoWorld)
        seconds, before.is_kept, keep = starting.result(), True, True
        page.open()
        say(up_text(host, time.monotonic() - began, seconds, page.address))
        say("ready")
        await host.ended
        if lasting:
            say(
                "the worlds keep running; `fleet up` in the same folder serves them again, and without --detached it "
                "stops them when it ends"
            )
    finally:
        starting.cancel()
        await page.close()
        await commands.close()  # before the host: a move must be over before the folder is released
        if not keep:
            before.restore_plan()
        await host.close()
        await classes.close()


async def _either(*futures: asyncio.Future[None] | asyncio.Future[float]) -> None:
    """Wait until one is done."""
    done = asyncio.Event()
    for future in futures:
        future.add_done_callback(lambda _: done.set())
    await done.wait()


def _end(ended: asyncio.Future[None]) -> None:
    if not ended.done():
        ended.set_result(None)


async def _until_up(fleet_host: FleetHost) -> float:
    """Start all shards; return the time to load, s, once each is up or has failed, and one is up. Raises NoWorld."""
    seconds, shards = await fleet_host.start(), fleet_host.shards.values()

    def is_decided() -> bool:
        return any(shard.state is State.READY for shard in shards) or all(shard.hopeless for shard in shards)

    if not is_decided():
        log.warning("no world is up yet: %s", _reason(fleet_host) or "none has answered")
    await fleet_host.shards.until(is_decided)
    if all(shard.hopeless for shard in shards):
        raise NoWorld(f"no world can start: {_reason(fleet_host)}")
    fleet_host.shards.report_hopeless()
    return seconds


def _reason(fleet_host: FleetHost) -> str:
    """Return why a shard is down, of one that tries again if there is one; empty: none is, or none says."""
    down = sorted((shard for shard in fleet_host.shards.values() if shard.reason), key=lambda shard: shard.hopeless)
    return down[0].reason if down else ""


def _have_been_up(fleet_host: FleetHost) -> bool:
    """Return whether robots may have stored data."""
    return any(shard.state is State.READY or shard.restarts for shard in fleet_host.shards.values())


def _first_address(fleet_host: FleetHost) -> str:
    return str(fleet_host.plan.shards[0].settings["robots"][0]["address"])


def up_text(fleet_host: FleetHost, seconds: float, warm: float, page: str) -> str:
    """Return the text of `fleet up` when all worlds are up or have failed."""
    shards = list(fleet_host.shards.values())
    ready = [shard for shard in shards if shard.state is State.READY]
    robots = sum(len(shard.plan.robots) for shard in ready)
    where = f"; all on one page: {page}" if page else ""
    loading = f" ({warm:.1f} s of it to load)" if warm else ""
    return (
        f"{len(ready)} of {len(shards)} worlds with {robots} robot{'s' * (robots != 1)} are up"
        f" after {seconds:.1f} s{loading};"
        f" robots on {_first_address(fleet_host)} and up{where}."
        " `roboglot fleet list` shows them."
    )
