"""Plays a plan in a lockstep copy of the world, in a process of its own, before a robot does it.

The copy is made from the world's file and seed; robots, people and boxes stand where they really are. Its robot has
an empty map whose origin is where it stands, so a goal is taken relative to where the robot believes to be. Charge,
faults and what else happens by chance are not copied.
"""

from __future__ import annotations

import asyncio
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypedDict

import msgspec

SECONDS_MAX = 60.0  # of real time that a rehearsal may take
ROBOT_SECONDS_MAX = 180.0  # of robot time for one step
TICK = 0.2  # s of robot time between two looks
STEPS_MAX = 20
Number = Annotated[float, msgspec.Meta(ge=-10_000, le=10_000)]


class Step(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """One of both: ``go_to`` a point of the map, or ``drive`` [x m/s, y m/s, yaw rad/s, s]."""

    go_to: tuple[Number, Number] | None = None
    drive: tuple[Number, Number, Number, Annotated[float, msgspec.Meta(gt=0, le=2)]] | None = None


class Copy(msgspec.Struct):
    """What the child process makes the copy from. Poses are [x, y, yaw, floor], boxes [… , width, depth]."""

    world: str
    seed: int
    body: str
    robot: tuple[float, float, float, int]
    believed: tuple[float, float, float]
    people: dict[str, tuple[float, float, float, int]]
    boxes: list[tuple[float, float, float, int, float, float]]
    steps: list[Step]


class Played(TypedDict):
    """How one step went; ``at``: seconds of robot time after which it was over."""

    step: str
    status: str
    reason: str
    at: float


class Rehearsal(TypedDict):
    """``hits``: what bumped, blocked or braked the robot, in words. ``end``: where it would stand in its map."""

    steps: list[Played]
    hits: list[str]
    end: list[float]
    seconds: float


async def rehearse(
    world: Mapping[str, Any], robot: str, believed: Sequence[float], steps: Sequence[Mapping[str, Any]]
) -> Rehearsal:
    """Play ``steps`` with a copy of ``robot``, which believes to be at [x, y, yaw]. Raises ValueError."""
    if robot not in world["robots"]:
        raise ValueError(f"robot {robot} is a real one: there is no copy of its world")
    if not 0 < len(steps) <= STEPS_MAX:
        raise ValueError(f"a plan has 1 to {STEPS_MAX} steps")
    values = {
        "world": world["world"],
        "seed": world["seed"],
        "body": world["bodies"][robot],
        "robot": world["robots"][robot],
        "believed": believed[:3],
        "people": world["people"],
        "boxes": list(world["boxes"].values()),
        "steps": steps,
    }
    try:
        copy = msgspec.convert(values, Copy)
    except msgspec.ValidationError as error:
        raise ValueError(f"the plan cannot be played: {error}") from None
    if any((step.go_to is None) == (step.drive is None) for step in copy.steps):
        raise ValueError("a step is go_to or drive")
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "roboglot.agents.play", stdin=pipe, stdout=pipe, stderr=pipe
    )
    try:
        async with asyncio.timeout(SECONDS_MAX):
            out, errors = await process.communicate(msgspec.json.encode(copy))
    except TimeoutError:
        raise ValueError(f"the rehearsal took longer than {SECONDS_MAX:g} s") from None
    finally:
        if process.returncode is None:
            process.kill()
    if process.returncode:
        words = errors.decode("utf-8", "replace").strip().splitlines()
        raise ValueError(f"the copy could not be made: {words[-1] if words else 'it was killed'}")
    return msgspec.json.decode(out, type=Rehearsal)


def relative(point: tuple[float, float], believed: tuple[float, float, float]) -> tuple[float, float]:
    """Return a point of the map as seen from the believed pose."""
    x, y, yaw = believed
    dx, dy = point[0] - x, point[1] - y
    return dx * math.cos(yaw) + dy * math.sin(yaw), -dx * math.sin(yaw) + dy * math.cos(yaw)


def absolute(pose: tuple[float, float, float], believed: tuple[float, float, float]) -> list[float]:
    """Return a pose seen from the believed one in the map."""
    x, y, yaw = believed
    px, py, angle = pose
    end = (x + px * math.cos(yaw) - py * math.sin(yaw), y + px * math.sin(yaw) + py * math.cos(yaw), yaw + angle)
    return [round(value, 3) for value in (*end[:2], math.remainder(end[2], math.tau))]
