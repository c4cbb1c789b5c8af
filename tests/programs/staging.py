"""Plays programs on a simulated robot in lockstep: robot time passes only while a call of the program waits.

So a program's output and effects are the same on any machine. People and things act at given seconds.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.light import Colour, Light
from roboglot.model.errors import RobotError
from roboglot.model.events import SoundPlayed, Spoke
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    Failed,
    Finished,
    Output,
)
from roboglot.programs.engine.run import Run
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.functions.session import Session, TaskEnded
from roboglot.programs.functions.table import call as call_function

PRELUDE = ability_set()
PACE = 0.05  # s of robot time between two samples
LONGEST = 600.0  # s of robot time for one program
Act = tuple[float, Callable[[], object]]  # s after the program's start, and the event


@dataclass
class Performance:
    """Record of a program: its output, calls, blocks and log, its end, how long it took (robot time, s).

    ``said`` are the texts and sounds that the robot's loudspeaker played, ``colours`` those its lights showed.
    """

    printed: str = ""
    calls: list[str] = field(default_factory=list)
    blocks: list[str] = field(default_factory=list)
    log: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    colours: set[Colour] = field(default_factory=set)
    breakpoints: int = 0
    ending: Finished | Failed | None = None
    seconds: float = 0.0

    def begin_block(self, id: str) -> None:
        self.blocks.append(id)

    async def breakpoint(self) -> None:
        self.breakpoints += 1

    def write(self, _level: str, text: str) -> None:
        self.log.append(text)


class Stage:
    """A robot on which programs are played one after the other."""

    def __init__(self, engine: Engine, robot: Robot, clock: LockstepClock) -> None:
        self._engine = engine
        self._robot = robot
        self._clock = clock

    async def play(self, source: str, acts: Iterable[Act] = ()) -> Performance:
        """Play a program from its start to its end; cancel what it has begun then."""
        played, start = Performance(), self._clock.time()
        coming = sorted(((start + after, act) for after, act in acts), key=lambda act: act[0])
        session = Session(self._robot, "t", played)
        run = await self._engine.start(source, PRELUDE, seed=1)
        with self._robot.events.subscribe(Spoke, SoundPlayed) as heard:
            async for event in run:
                match event:
                    case Output(text=text):
                        played.printed += text
                    case Call():
                        played.calls.append(event.name)
                        await self._answer(run, event, session, played, coming)
                    case Finished() | Failed():
                        played.ending = played.ending or event
            for sounded in heard.drain():
                match sounded:
                    case Spoke(text=said) | SoundPlayed(name=said):
                        played.said.append(said)
        session.cancel("the program has ended")
        played.seconds = self._clock.time() - start
        return played

    async def _answer(self, run: Run, event: Call, session: Session, played: Performance, coming: list[Act]) -> None:
        answering = asyncio.create_task(call_function(session, event.name, event.args, event.kwargs))
        await self._clock.advance(0.0)
        latest = self._clock.time() + LONGEST
        while not answering.done():
            while coming and self._clock.time() >= coming[0][0] - 1e-9:
                coming.pop(0)[1]()
            await self._clock.advance(PACE)
            assert self._clock.time() < latest, f"{event.name} did not return"
        if Light in self._robot:
            light = self._robot[Light]
            played.colours |= {light.state(zone).colour for zone in light.zones}
        try:
            run.calls.reply(event.id, answering.result())
        except TaskEnded:
            played.ending = Finished()
            await run.kill()
        except (RobotError, TypeError, ValueError, NotImplementedError) as error:
            run.calls.fail(event.id, type(error).__name__, str(error))
