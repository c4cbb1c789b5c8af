"""Server of the owner's commands to a fleet: the socket behind ``roboglot fleet list|stop|…``."""

from __future__ import annotations

import asyncio
from pathlib import Path

import msgspec

from roboglot.hosting.local_socket import LocalServer
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.moving import move_robot
from roboglot.shards.requests import SOCKET, Answer, Request, RobotRow, Row
from roboglot.shards.supervisor import Shard
from roboglot.validation import why_invalid


class FleetDesk(LocalServer):
    """Command server of one fleet."""

    def __init__(self, supervisor: FleetHost, folder: Path) -> None:
        self._supervisor = supervisor
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
        except (LookupError, ValueError, OSError) as refused:
            error = str(refused.args[0]) if refused.args else type(refused).__name__
        rows = [_row(shard) for shard in self._supervisor.shards.values()]
        return msgspec.json.encode(Answer(rows, self._supervisor.nursery, error))

    async def _grant(self, request: Request) -> None:
        supervisor = self._supervisor
        if request.do in ("move", "reset") and not supervisor.stores_here:
            raise ValueError(f"{request.do} is for fleets of one machine: robots of a cluster store in the database")
        match request.do:
            case "move":
                await move_robot(supervisor, request.robot, request.to)
            case "reset":
                await supervisor.reset(self._shard(request.shard))
            case verb:
                shards = [self._shard(request.shard)] if request.shard else list(supervisor.shards.values())
                act = supervisor.stop if verb == "stop" else supervisor.restart
                await asyncio.gather(*map(act, shards))

    def _shard(self, name: str) -> Shard:
        return self._supervisor.shards[self._supervisor.plan.find(name).name]


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
