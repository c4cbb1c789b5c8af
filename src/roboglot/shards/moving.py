"""Moves a robot from one shard to another, with all its stored data, its address and its serial number."""

from __future__ import annotations

import asyncio
import sqlite3
from pathlib import Path

from roboglot.config import ROBOTS_MAX, serial_of
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.plan import ShardPlan, checked, save
from roboglot.shards.states import State
from roboglot.storage.transfer import copy_robot, forget_robot

DATABASE = "roboglot.db"  # in a shard's data folder


class NotForgotten(Exception):
    """A robot has moved, and its old shard still has a copy of its data, which a move back would replace."""


async def move_robot(supervisor: FleetHost, robot: str, to: str) -> None:
    """Move a robot to shard ``to``; both shards are down meanwhile. Raises LookupError, ValueError if it cannot move.

    Its rows are copied, then the plan is changed, then the old rows are removed: a crash at any moment leaves the robot
    in one shard, with all its rows. So does a full disk, which raises OSError or sqlite3.Error. Raises NotForgotten if
    the robot has moved and its old rows are still there, and FleetEnds.
    """
    plan = supervisor.plan
    old, new = plan.home_of(robot), plan.shard(to)
    if old is new:
        return
    if len(old.robots) == 1:
        raise ValueError(f"{robot} is the only robot of {old.name}: a world needs one")
    if len(new.robots) >= ROBOTS_MAX:
        raise ValueError(f"{new.name} has {ROBOTS_MAX} robots already")
    settings = next(r for r in old.settings["robots"] if r["name"] == robot)
    moved = {"serial": serial_of(old.settings["seed"], robot), **settings}
    checked(ShardPlan(new.name, {**new.settings, "robots": [*new.settings["robots"], moved]}))
    both = supervisor.shards[old.name], supervisor.shards[new.name]
    running = [shard for shard in both if shard.state is not State.STOPPED]
    await asyncio.gather(*map(supervisor.stop, both))
    try:
        await asyncio.to_thread(copy_robot, robot, _database(old), _database(new))
        at = old.settings["robots"].index(settings)
        del old.settings["robots"][at]
        new.settings["robots"].append(moved)
        try:
            await asyncio.to_thread(save, plan, supervisor.folder)
        except BaseException:  # the stored plan has it in the old shard, so it must run there
            new.settings["robots"].remove(moved)
            old.settings["robots"].insert(at, settings)
            raise
        try:
            await asyncio.to_thread(forget_robot, robot, _database(old))
        except (OSError, sqlite3.Error) as error:
            raise NotForgotten(f"{robot} is in {new.name}, but {old.name} keeps a copy of its data: {error}") from None
    finally:
        await asyncio.gather(*map(supervisor.restart, running))


def _database(shard: ShardPlan) -> Path:
    folder = Path(shard.settings["data"])
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    return folder / DATABASE
