"""Random walks at a door: the seeds, a diary for failures, and a witness by the truth of the world.

What no action moves has to stand, and once all clients are gone the robot comes to rest.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import pytest

from roboglot.model.actions import Action
from roboglot.model.components.motion.arm import ARM, Arm
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.motion.legs import LEGS
from roboglot.model.components.motion.servo import Servos, servo_resource
from roboglot.model.events import ActionChanged
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.drivers.settling import settle

LOOK = 0.1  # s between two looks
GRACE = 0.5  # s after the last action in which a part may come to rest
CREEP, TURN = 0.003, 0.01  # m and rad between two looks up to which a robot stands
SHOWN = 40  # lines of the diary that a failure shows
CHOSEN = os.environ.get("WALKS", "")  # "5000-5100": these walks instead of the usual ones, the last one included


def seeds(quick: int, slow: int) -> list[Any]:
    """Return numbers of walks: the first few for every run, the others for ``--slow``; or those of ``WALKS``."""
    if CHOSEN:
        first, _, last = CHOSEN.partition("-")
        return list(range(int(first), int(last or first) + 1))
    return [*range(quick), *(pytest.param(number, marks=pytest.mark.slow) for number in range(quick, slow))]


def walks(rounds: int, slow: int) -> list[Any]:
    """Return seeds and rounds: the beginning of a walk for every run, whole ones for ``--slow``; or those of ``WALKS``.

    The whole ones take seconds each.
    """
    if CHOSEN:
        return [(number, rounds) for number in seeds(0, 0)]
    return [(0, rounds // 5), *(pytest.param(number, rounds, marks=pytest.mark.slow) for number in range(slow))]


class Diary(list[tuple[object, ...]]):
    """Lines about what was asked and answered on a walk."""

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Print its end if the walk fails."""
        try:
            yield
        except BaseException:
            print(*self[-SHOWN:], sep="\n")
            raise


class Witness:
    """Lets robot time pass, looks at one robot ten times a second, and keeps a diary of what was asked."""

    def __init__(self, world: World, robot: Robot, forward: Forward) -> None:
        self.world, self.robot, self._forward = world, robot, forward
        self._freed: dict[str, float] = {}  # s, by resource: when its last action ended
        self.ends: dict[int, Pose] = {}  # where the robot was when its actions ended
        robot.events.listen(ActionChanged, self._note)
        self._joints: dict[str, tuple[float, ...]] = {}
        self._before, self._followed = (self.now, self.pose), -math.inf
        self.diary = Diary()
        self.rolls = False  # its brake is released, or hands move it
        self.stopped_at = math.inf  # s: an emergency stop; it has to stand GRACE later, whatever runs

    @property
    def now(self) -> float:
        return self.robot.clock.time()

    @property
    def pose(self) -> Pose:
        return self.world.truth.pose_of(self.robot.id)

    @property
    def running(self) -> list[tuple[str, str, object]]:
        """The actions under way, for messages."""
        return [(action.name, action.status.name, action.goal) for action in self.robot.actions.running()]

    def note(self, *words: object) -> None:
        """Write a line into the diary."""
        self.diary.append((round(self.now, 2), *words))

    def writing(self) -> AbstractContextManager[None]:
        """Print the diary's end if the walk fails."""
        return self.diary.writing()

    async def pass_time(self, seconds: float) -> None:
        """Let time pass, and look."""
        await settle()
        while seconds > 1e-9:
            step = min(LOOK, seconds)
            await self._forward(seconds=step)
            seconds -= step
            self.look()
        await settle()

    async def sees_it_rest(self, seconds: float) -> None:
        """Assert that after ``seconds`` no action runs, and that the robot stands."""
        left = seconds
        while left > 0 and self.robot.actions.running():
            await self.pass_time(GRACE)
            left -= GRACE
        assert not self.running, f"still running {seconds} s later: {self.running}"
        await self.pass_time(2 * GRACE)
        assert not self.running, f"running again: {self.running}"

    def look(self) -> None:
        """Assert that what no action moves stands."""
        (before, there), (now, here) = self._before, (self.now, self.pose)
        self._before, follows = (now, here), self._follows
        self._look_at_joints(now)
        stands = self._free(BASE, LEGS) or before - self.stopped_at > GRACE
        if not stands or self.rolls or now - before < 1e-6:
            return
        gone, turned = there.distance_to(here), abs(wrap_angle(here.yaw - there.yaw))
        share = max(1.0, (now - before) / LOOK)
        words = (
            f"at {now:.2f} s nothing may move the robot, and it goes {gone:.3f} m, {math.degrees(turned):.1f} degrees"
        )
        assert gone <= CREEP * share, words
        assert turned <= TURN * share or follows, words

    @property
    def _follows(self) -> bool:
        """True if the chassis turns after the gimbal, or did so until just now."""
        if Gimbal in self.robot and self.robot[Gimbal].mode is FollowMode.GIMBAL_LEAD:
            self._followed = self.now
        return self.now - self._followed <= GRACE

    def _look_at_joints(self, now: float) -> None:
        joints: dict[str, tuple[float, ...]] = {}
        if Arm in self.robot:
            joints[ARM] = (self.robot[Arm].position.x, self.robot[Arm].position.z)
        if Servos in self.robot:
            servos = self.robot[Servos]
            joints |= {servo_resource(n): (servos.angle(n),) for n in range(1, servos.count + 1)}
        for name, place in joints.items():
            if self._free(name) and name in self._joints:
                assert place == self._joints[name], f"at {now:.2f} s nothing moves {name}, and it moves"
        self._joints = joints

    def _free(self, *resources: str) -> bool:
        """Return whether no action has held one of them for GRACE seconds."""
        running = {held for action in self.robot.actions.running() for held in action.resources}
        return all(held not in running and self.now - self._freed.get(held, 0.0) > GRACE for held in resources)

    def _note(self, event: ActionChanged) -> None:
        action: Action = event.action
        if action.status.ended:
            self.ends[action.id] = self.pose
            self.note(action.name, action.id, action.status.name, action.reason, self.pose)
            self._freed |= dict.fromkeys(action.resources, event.stamp)


def has_keys(value: Any, kinds: Mapping[str, type | tuple[type, ...]]) -> bool:
    """Return whether an answer has these keys, each of its kind."""
    return isinstance(value, dict) and all(isinstance(value.get(key), kind) for key, kind in kinds.items())
