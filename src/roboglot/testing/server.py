"""Robots with all their doors on real ports, in a thread of the test's process; any client may drive them."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import shutil
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from roboglot.extras import explaining
from roboglot.testing.addresses import free_addresses, give_back
from roboglot.testing.blocking import PATIENCE, Loop
from roboglot.testing.clients import Clients
from roboglot.testing.requirements import Wanted
from roboglot.testing.tracks import LOOK_AGAIN, Ways, pass_time

if TYPE_CHECKING:
    from roboglot.config import Config
    from roboglot.model.geometry import Pose
    from roboglot.model.robot import Robot
    from roboglot.model.tap import Exchange
    from roboglot.runtime import Runtime

T = TypeVar("T")
KEPT_EXCHANGES = 2000
START_SECONDS_MAX = 240.0  # including the time to compile kernels


class NotInTime(AssertionError):
    """A condition did not hold in time."""


class RobotServer:
    """A world and its robots, each at its own address, with every vendor's ports.

    Methods block, and may be called from any thread but the server's own.
    """

    clients: Clients  # set by ``start``, as are the next two
    config: Config
    app_port: int  # at which the robots call a dog's app

    def __init__(self, wanted: Wanted | None = None, *, data: Path | None = None) -> None:
        self.wanted = wanted or Wanted()
        self._given_data = data
        self.data = data or Path(tempfile.mkdtemp(prefix="roboglot-test-"))
        self.addresses: dict[str, str] = {}
        self.exchanges: deque[Exchange] = deque(maxlen=KEPT_EXCHANGES)
        self._runtime: Runtime | None = None
        self._loop: Loop | None = None
        self._thread: threading.Thread | None = None
        self._ways = Ways()
        self.tracks = self._ways.tracks

    # -- lifecycle --

    def __enter__(self) -> RobotServer:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def start(self) -> RobotServer:
        """Start; return when every door answers and the robots are localised.

        Raises the errors of ``up``, and MissingExtra.
        """
        first = free_addresses(len(self.wanted.robots))
        self.addresses = self.wanted.addresses(first)
        loop = _new_loop()
        self._loop = Loop(loop)
        self._thread = threading.Thread(target=_serve, args=(loop,), name="roboglot", daemon=True)
        self._thread.start()
        try:
            with explaining("a robot's server", "up"):
                self.config = self.wanted.configuration(first, self.data)
                self.clients = Clients(self.config, self._loop)
                self.app_port = self.clients.app_port
                self._loop.run(self._start, within=START_SECONDS_MAX)
        except BaseException:
            self.close()
            raise
        return self

    def close(self) -> None:
        """Close the clients, stop, and delete the data."""
        if self._loop is None or self._thread is None:
            return
        try:
            if self._runtime is not None:
                self.clients.close()
                self._loop.run(self._runtime.close)
        finally:
            self._loop.loop.call_soon_threadsafe(self._loop.loop.stop)
            self._thread.join()
            self._loop = self._thread = self._runtime = None
            give_back(self.addresses.values())
            gc.unfreeze()  # objects that the runtime froze are garbage now
            if self._given_data is None:
                shutil.rmtree(self.data, ignore_errors=True)

    async def _start(self) -> None:
        from roboglot.runtime import Runtime

        self._runtime = Runtime(self.config)
        for name, robot in self._runtime.fleet.robots.items():
            robot.tap.listen(self.exchanges.append)
            self.tracks[name] = []
        self._ways.begin(self._runtime.fleet, self._runtime.clock)
        await self._runtime.start()
        self._ways.follow()
        if not self.wanted.recording:
            await self._ways.wait_for_places()
        self._break_things()

    # -- contents --

    @property
    def runtime(self) -> Runtime:
        """The program itself; use it in its own thread only (``call``)."""
        if self._runtime is None:
            raise RuntimeError("the robot is not up")
        return self._runtime

    @property
    def loop(self) -> Loop:
        """Event loop of the server."""
        if self._loop is None:
            raise RuntimeError("the robot is not up")
        return self._loop

    def call(
        self,
        function: Callable[..., T | Coroutine[object, None, T]],
        *arguments: object,
        within: float = PATIENCE,
        **named: object,
    ) -> T:
        """Call a function, or run a coroutine function, in the robots' loop; return its result."""
        result: T = self.loop.run(function, *arguments, within=within, **named)
        return result

    @property
    def address(self) -> str:
        """The first robot's address."""
        return next(iter(self.addresses.values()))

    @property
    def url(self) -> str:
        """URL of the first robot's REST API."""
        return f"http://{self.address}:{self.config.doors['slamware'].port}"

    @property
    def programs_url(self) -> str:
        """URL of the first robot's WebSocket of block programs."""
        return f"ws://{self.address}:{self.config.doors['visual'].port}/programs"

    @property
    def robot(self) -> Robot:
        """The first robot, as programs see it."""
        return next(iter(self.runtime.fleet.robots.values()))

    @property
    def truth(self) -> _LoopProxy:
        """Ground truth of the world (``roboglot.simulation.world.truth``)."""
        return _LoopProxy(self.runtime.fleet.world.truth, self.loop)

    @property
    def stage(self) -> _LoopProxy:
        """Interventions in the world: place, push, add_obstacle, inject_fault, person (``roboglot.model.stage``)."""
        return _LoopProxy(self.runtime.fleet.world.stage, self.loop)

    def pose(self, robot: str = "") -> Pose:
        """Return the true pose of a robot (default: the first) in the world's frame."""
        found: Pose = self.truth.pose_of(robot or next(iter(self.addresses)))
        return found

    def moved(self, robot: str = "") -> Pose:
        """Return a robot's true pose relative to its start: x ahead, y to the left."""
        name = robot or next(iter(self.addresses))
        return self.pose(name).relative_to(self._ways.origins[name])

    @property
    def time(self) -> float:
        """Robot time, s since the start."""
        return self.runtime.clock.time()

    # -- time --

    def forward(self, seconds: float) -> None:
        """Let ``seconds`` of robot time pass: in lockstep as fast as possible, else at the clock's speed."""
        self.loop.run(pass_time, self.runtime.clock, seconds, within=PATIENCE + seconds / self.wanted.speed)

    def wait_until(self, condition: Callable[[], object], *, within: float, what: str = "") -> None:
        """Wait until ``condition()``, called in the robots' loop, holds. Raises NotInTime after ``within`` robot s."""
        end = self.time + within
        while not self.loop.run(condition):
            if self.time >= end:
                raise NotInTime(f"{what or 'the condition'} does not hold after {within:g} s")
            self.forward(LOOK_AGAIN)

    # -- between tests --

    def reset(self) -> None:
        """Restore the start: actions end; robots are charged, in place and localised; no faults, no boxes."""
        self.clients.close()
        self.loop.run(self._reset)
        self.exchanges.clear()
        self._ways.clear()

    async def _reset(self) -> None:
        fleet = self.runtime.fleet
        stage = fleet.world.stage
        for robot in fleet.robots.values():
            await robot.actions.cancel(reason="the test has ended")
        stage.clear_fault()
        for box in stage.obstacles:
            stage.remove_obstacle(box.number)
        for person in stage.people:
            stage.person(person.name).resume()
        await self._ways.put_back()

    def prepare(self, wanted: Wanted) -> None:
        """Prepare this server for another test: reset it, then inject that test's faults."""
        self.reset()
        self.wanted = wanted
        self.loop.run(self._break_things)

    def _break_things(self) -> None:
        stage = self.runtime.fleet.world.stage
        for fault in self.wanted.faults:
            stage.inject_fault(fault.kind, fault.robot, **dict(fault.options))


class _LoopProxy:
    """A proxy that calls an object's methods, and those of the results, in the robots' loop."""

    def __init__(self, target: object, loop: Loop) -> None:
        self._target, self._loop = target, loop

    def __dir__(self) -> list[str]:
        return dir(self._target)

    def __getattr__(self, name: str) -> Any:
        value = self._loop.run(lambda: getattr(self._target, name))
        if not callable(value):
            return value

        def call(*arguments: object, within: float = PATIENCE, **named: object) -> object:
            result = self._loop.run(value, *arguments, within=within, **named)
            return _LoopProxy(result, self._loop) if hasattr(result, "walk_to") else result

        return call


def _new_loop() -> asyncio.AbstractEventLoop:
    try:
        import uvloop
    except ImportError:
        return asyncio.SelectorEventLoop()
    return uvloop.new_event_loop()


def _serve(loop: asyncio.AbstractEventLoop) -> None:
    asyncio.set_event_loop(loop)
    try:
        loop.run_forever()
    finally:
        for task in asyncio.all_tasks(loop):
            task.cancel()
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()


@contextlib.contextmanager
def serving(**values: object) -> Iterator[RobotServer]:
    """Start robots for a ``with``: ``with serving(world="empty", speed=8) as server``."""
    from roboglot.testing.requirements import wanted_of

    with RobotServer(wanted_of(values)) as server:
        yield server
