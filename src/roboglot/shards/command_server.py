"""Server of the owner's commands to a fleet: the socket behind ``roboglot fleet list|stop|…``."""

from __future__ import annotations

import asyncio
import shutil
import sqlite3
from pathlib import Path

import msgspec

from roboglot.hosting.local_socket import LocalServer
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.moving import move_robot
from roboglot.shards.requests import SOCKET, Answer, Request, RobotRow, Row
from roboglot.shards.states import Shard
from roboglot.validation import why_invalid


class CommandServer(LocalServer):
    """Command server of one fleet."""

    def __init__(self, host: FleetHost, folder: Path) -> None:
        self._host = host
        super().__init__(folder / SOCKET, "roboglot fleet", self._answer)
        self._turn = asyncio.Lock()

    async def _answer(self, line: bytes) -> bytes:
        error = ""
        try:
            request = msgspec.json.decode(line, type=Request)
            if request.do != "look":
                async with self._turn:
                    await self._grant(request)
        except msgspec.DecodeError as refused:
            error = why_invalid(refused, "the request", wanted=Request)
        except (LookupError, ValueError, OSError, sqlite3.Error) as refused:
            error = _why(refused)
        rows = [_row(shard) for shard in self._host.shards.values()]
        return msgspec.json.encode(Answer(rows, self._host.nursery, error))

    async def _grant(self, request: Request) -> None:
        host = self._host
        if request.do in ("move", "reset") and not host.stores_here:
            raise ValueError(f"{request.do} is for fleets of one machine: robots of a cluster store in the database")
        match request.do:
            case "move":
                await move_robot(host, request.robot, request.to)
            case "reset":
                await _reset(host, self._shard(request.shard))
            case verb:
                shards = [self._shard(request.shard)] if request.shard else list(host.shards.values())
                act = host.stop if verb == "stop" else host.restart
                await asyncio.gather(*map(act, shards))

    def _shard(self, name: str) -> Shard:
        return self._host.shards[self._host.plan.find(name).name]


async def _reset(host: FleetHost, shard: Shard) -> None:
    """Delete a shard's stored data (programs, maps, places, certificates) and restart it.

    Raises ValueError if the data is in a database, OSError if the folder cannot be deleted.
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
        reason=shard.reason,
    )
