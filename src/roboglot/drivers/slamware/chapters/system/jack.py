"""The jack of a Slamware robot: commanded to move and polled until it arrives."""

from __future__ import annotations

from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.slamware.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.logistics.jack import JACK, Jack, JackStage
from roboglot.model.errors import Blocked, Refused
from roboglot.model.events import JackChanged
from roboglot.model.robot import Robot

STROKE = 0.06  # m; not reported
LOWEST, HIGHEST = 31, 26_000_001  # counts of the drive at the ends, as seen on robots
STAGES = {2: JackStage.DOWN, 3: JackStage.MOVING, 4: JackStage.STOPPED, 5: JackStage.UP}
PERIOD = 0.1  # s between two polls
BEGUN_WITHIN = 1.0  # s until it must have begun to move


class SlamwareJack(Jack):
    """``system/v1/jack/status``. The load is not reported."""

    stroke = STROKE

    def __init__(self, robot: Robot, client: SlamwareClient, supervisor: Supervisor) -> None:
        self._robot, self._client, self._supervisor = robot, client, supervisor
        self._stage, self._share, self._alarm = JackStage.DOWN, 0.0, ""

    async def refresh(self) -> None:
        """Poll the jack. Raises SlamwareRefused without a jack."""
        reply = await self._client.get_jack_status()
        before = self._stage, self._alarm
        self._stage = STAGES.get(reply.stage, JackStage.STOPPED)
        self._share = min(max((reply.actual_pos - LOWEST) / (HIGHEST - LOWEST), 0.0), 1.0)
        self._alarm = f"alarm {reply.alarm}" if reply.alarm else ""
        if (self._stage, self._alarm) != before:
            now = self._robot.clock.time()
            self._robot.events.publish(JackChanged(stamp=now, stage=self._stage, alarm=self._alarm))

    @property
    def stage(self) -> JackStage:
        return self._stage

    @property
    def position(self) -> float:
        return self._share * STROKE

    @property
    def loaded(self) -> bool:
        raise Refused("this robot does not report whether its jack is loaded")

    @property
    def alarm(self) -> str:
        return self._alarm

    def raise_platform(self, *, source: str = "") -> Action:
        return self._start("raise the jack", JackStage.UP, source)

    def lower_platform(self, *, source: str = "") -> Action:
        return self._start("lower the jack", JackStage.DOWN, source)

    def clear_alarm(self) -> None:
        self._supervisor.send("clearing the jack's alarm", self._client.set_jack_req("ClearAlarm"))

    def _start(self, name: str, goal: JackStage, source: str) -> Action:
        self._supervisor.link.require()
        if self._alarm:
            raise Refused(f"the jack is in alarm: {self._alarm}")

        async def run(_: Action) -> None:
            with robot_errors():
                await self._client.set_jack_req("Up" if goal is JackStage.UP else "Down")
                try:
                    await self._arrive(goal)
                except BaseException:
                    await self._halt()
                    raise

        return self._robot.actions.start(name, run, resources={JACK}, goal=goal, source=source)

    async def _arrive(self, goal: JackStage) -> None:
        clock, moving = self._robot.clock, False
        begun = clock.time()
        while True:
            await clock.sleep(PERIOD)
            self._supervisor.link.require()
            await self.refresh()
            if self._alarm:
                raise Blocked(f"the jack is in alarm: {self._alarm}")
            if self._stage is goal:
                return
            moving = moving or self._stage is JackStage.MOVING
            if self._stage is not JackStage.MOVING and (moving or clock.time() - begun > BEGUN_WITHIN):
                raise Blocked(f"the jack remains {self._stage}")

    async def _halt(self) -> None:
        try:
            await self._client.set_jack_req("Stop")
        except ClientError:
            return  # removed, or already at rest
