"""The loudspeaker of a dog: volume by 1012; speech by a one-line program, as the protocol has no command for it."""

from __future__ import annotations

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.clients.cyberdog.values import ProgramFrame
from roboglot.drivers.cyberdog.telemetry import StatusPoll
from roboglot.drivers.cyberdog.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.interaction.speaker import SPEAKER, Speaker, check_text, check_volume
from roboglot.model.errors import Expired, Refused
from roboglot.model.events import Spoke
from roboglot.model.feed import Viewer
from roboglot.model.robot import Robot
from roboglot.model.sound import Sound

TASK = "roboglot_says"
SAID_WITHIN = 120.0  # s


class CyberDogSpeaker(Speaker):
    """``volume`` is polled every two seconds."""

    def __init__(self, robot: Robot, client: CyberDogClient, supervisor: Supervisor, status: StatusPoll) -> None:
        self._robot, self._client, self._supervisor, self._status = robot, client, supervisor, status

    @property
    def volume(self) -> float:
        return (self._status.volume or 0) / 100

    async def set_volume(self, volume: float) -> None:
        check_volume(volume)
        self._supervisor.link.require()
        with robot_errors():
            await self._client.set_volume(round(volume * 100))
            await self._status.ask()

    def say(self, text: str, *, source: str = "") -> Action:
        check_text(text)
        self._supervisor.link.require()

        async def run(_: Action) -> None:
            begun = self._robot.clock.time()
            with robot_errors():
                await self._speak(text)
            now = self._robot.clock.time()
            self._robot.events.publish(Spoke(stamp=now, text=text, seconds=now - begun, audible=True))

        return self._robot.actions.start("say", run, resources={SPEAKER}, goal=text, source=source)

    def play(self, sound: Sound, *, source: str = "") -> Action:
        raise Refused("this dog plays its own sounds only")

    async def _speak(self, text: str) -> None:
        client = self._client
        await client.deploy(TASK, f"cyberdog.audio.play({text!r})\n")
        with client.watch(ProgramFrame) as frames:
            await client.run_program(TASK)
            try:
                await self._robot.clock.wait_for(_ended(frames), SAID_WITHIN)
            except TimeoutError:
                raise Expired("the dog does not report the end of its speech") from None
            except BaseException:
                self._supervisor.send_aside("being silent", client.operate("task", "shutdown", TASK))
                raise


async def _ended(frames: Viewer[ProgramFrame]) -> None:
    async for frame in frames:
        if frame.feedback.get("operate") == "stop" and frame.feedback.get("target_id") == TASK:
            return
    raise Expired("the link is lost")
