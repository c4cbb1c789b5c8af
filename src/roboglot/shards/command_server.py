"""Server of the owner's commands to a fleet: the socket behind ``roboglot fleet list|stop|…``."""

from __future__ import annotations

import asyncio
import shutil
import sqlite3
from pathlib import Path

import msgspec

from roboglot.hosting.local_socket import LocalServer
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.moving import NotForgotten, move_robot
from roboglot.shards.requests import SOCKET, Answer, Request, RobotRow, Row
from roboglot.shards.states import FleetEnds, Shard, State
from roboglot.validation import decode_json, why_invalid

REFUSALS = LookupError, ValueError, FleetEnds
FAILURES = OSError, sqlite3.Error, NotForgotten


class CommandServer(LocalServer):
    """Command server of one fleet."""

    def __init__(self, host: FleetHost, folder: Path) -> None:
        self._host = host
        super().__init__(folder / SOCKET, "roboglot fleet", self._answer)
        self._turn = asyncio.Lock()
        self._closing = False

    async def close(self) -> None:
        """Refuse further commands, wait for one in progress, which fails instead of waiting for a shard, and close."""
        self._closing = True
        self._host.shards.end()
        async with self._turn:
            await super().close()

    async def _answer(self, line: bytes) -> bytes:
        error = ""
        try:
            request = decode_json(line, Request)
            if request.do != "look":
                async with self._turn:
                    error = await self._carry_out(request)
        except msgspec.DecodeError as refused:
            error = why_invalid(refused, "the request", wanted=Request)
        except REFUSALS as refused:
            error = _why(refused)
        rows = [_row(shard) for shard in self._host.shards.values()]
        return msgspec.json.encode(Answer(rows, self._host.nursery, error))

    async def _carry_out(self, request: Request) -> str:
        """Carry out a command; return what failed, empty: nothing. Raises one of REFUSALS if it does nothing."""
        if self._closing:
            raise FleetEnds("the fleet ends")
        if request.do in ("move", "reset") and not self._host.stores_here:
            raise ValueError(f"{request.do} is for fleets of one machine: robots of a cluster store in the database")
        shards, failed = self._shards_of(request), ""
        try:
            await self._act(request, shards)
        except FAILURES as error:
            failed = _why(error)
        down = [f"{s.plan.name} is down: {s.reason}" for s in shards if s.state is State.FAILED]
        if failed:
            return "; ".join([failed, *down])
        return _done(request) + "; ".join(down) if down else ""

    async def _act(self, request: Request, shards: list[Shard]) -> None:
        host = self._host
        match request.do:
            case "move":
                await move_robot(host, request.robot, request.to)
            case "reset":
                await _reset(host, shards[0])
            case verb:
                ends = await asyncio.gather(
                    *map(host.stop if verb == "stop" else host.restart, shards), return_exceptions=True
                )
                for error in filter(None, ends):
                    raise error

    def _shards_of(self, request: Request) -> list[Shard]:
        """Return the shards that a command stops or starts. Raises LookupError."""
        plan = self._host.plan
        if request.do == "move":
            plans = [plan.home_of(request.robot), plan.shard(request.to)]
        else:
            plans = [plan.find(request.shard)] if request.shard or request.do == "reset" else plan.shards
        return [self._host.shards[one.name] for one in plans]


def _done(request: Request) -> str:
    """Return what a command has done, before the report of shards that are down."""
    match request.do:
        case "move":
            return f"{request.robot} is in {request.to} now, but "
        case "reset":
            return "its data is deleted, but "
        case _:
            return ""


async def _reset(host: FleetHost, shard: Shard) -> None:
    """Delete a shard's stored data (programs, maps, places, certificates) and restart it.

    Raises ValueError if the data is in a database, OSError if the folder cannot be deleted, FleetEnds.
    """
    if shard.plan.settings.get("database"):
        raise ValueError("reset deletes the folders of shards, but these robots store in the database")
    await host.stop(shard)
    try:
        await asyncio.to_thread(_delete, Path(shard.plan.settings["data"]))
    finally:
        await host.restart(shard)


def _delete(folder: Path) -> None:
    """Delete a folder, if it is there. Raises OSError."""
    if folder.exists():
        shutil.rmtree(folder)


def _why(error: Exception) -> str:
    """Return the reason of a failed command in one sentence."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error.args[0]) if error.args else type(error).__name__


def _row(shard: Shard) -> Row:
    robots = [RobotRow(r["name"], r.get("body", "universal"), r["address"]) for r in shard.plan.settings["robots"]]
    return Row(
        name=shard.plan.name,
        state=shard.state,
        pid=shard.pid,
        robots=robots,
        seconds=asyncio.get_running_loop().time() - shard.since,
        restarts=shard.restarts,
        factor=shard.beat.factor,
        memory=shard.beat.memory,
        cpu=shard.beat.cpu,
        console=shard.ready.console if shard.ready else "",
        folder=str(shard.folder),
        reason=shard.trouble,
        silent=shard.silent,
    )
