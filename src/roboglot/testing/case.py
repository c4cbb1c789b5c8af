"""A robot for each test of a unittest class, with blocking clients; no event loop, no pytest."""

from __future__ import annotations

import contextlib
import os
import sys
import unittest
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from roboglot.testing.artifacts import FOLDER, folder_of, save
from roboglot.testing.blocking import Blocking
from roboglot.testing.requirements import Wanted, WantedFault, wanted_of
from roboglot.testing.server import RobotServer


class RobotTestCase(unittest.TestCase):
    """``class TestPatrol(RobotTestCase): world = "empty"``; then ``self.server``, ``self.rest``, ``self.robomaster``…

    ``world``, ``robots``, ``body``, ``seed``, ``speed``, ``lockstep``, ``recording``, ``doors`` are as in the pytest
    marker; ``faults`` are names of faults, or pairs of name and options. Artifacts of a failed test are in
    ``roboglot-failures``, in pytest's folder for them, or in the one that ROBOGLOT_FAILURES names; ``artifacts`` lists
    them, and pytest reports them as those of its own tests.
    """

    world: ClassVar[str] = "office"
    robots: ClassVar[tuple[str, ...]] = ("a",)
    body: ClassVar[str] = "universal"
    seed: ClassVar[int] = 1
    speed: ClassVar[float] = Wanted().speed
    lockstep: ClassVar[bool] = False
    recording: ClassVar[str] = ""
    faults: ClassVar[tuple[str | tuple[str, Mapping[str, object]], ...]] = ()
    doors: ClassVar[Mapping[str, object]] = {}
    server: RobotServer
    artifacts: Sequence[Path] = ()
    leave: Path | None = None  # pytest's folder for them

    def run(self, result: unittest.TestResult | None = None) -> unittest.TestResult | None:
        """Start the robot, run the test, save artifacts if it fails. A robot that cannot start is the test's error."""
        with contextlib.ExitStack() as stack:
            try:
                self.server = stack.enter_context(RobotServer(self._wanted()))
            except Exception:  # noqa: BLE001 - raised here, it would end the run of all tests
                found = result or self.defaultTestResult()
                found.startTest(self)
                found.addError(self, sys.exc_info())
                found.stopTest(self)
                return found
            return super().run(result)

    def _wanted(self) -> Wanted:
        """Return what the class asks for. Raises ValueError."""
        names = ("world", "robots", "body", "seed", "speed", "lockstep", "recording", "doors")
        faults = tuple(
            WantedFault(fault) if isinstance(fault, str) else WantedFault(fault[0], None, tuple(fault[1].items()))
            for fault in self.faults
        )
        return wanted_of({name: getattr(self, name) for name in names}, faults)

    def doCleanups(self) -> None:  # noqa: N802 - unittest's name
        """Save artifacts and clean up: unittest knows here whether the test failed, and the robot is still up."""
        super().doCleanups()
        if not getattr(getattr(self, "_outcome", None), "success", True):
            folder = folder_of(Path(os.environ.get("ROBOGLOT_FAILURES") or self.leave or FOLDER), self.id())
            self.artifacts = save(self.server, folder, self.id(), "failed: see the test's own output")

    @property
    def rest(self) -> Blocking:
        """A connected client of the REST API."""
        return self._client("rest")

    @property
    def robomaster(self) -> Blocking:
        """A connected client of the text protocol, in SDK mode."""
        return self._client("robomaster")

    @property
    def cyberdog(self) -> Blocking:
        """A connected client of the dog's app protocol."""
        return self._client("cyberdog")

    @property
    def program(self) -> Blocking:
        """A connected client of block programs."""
        return self._client("program")

    def _client(self, name: str) -> Blocking:
        found: Blocking | None = self.__dict__.get(f"_{name}")
        if found is None:
            found = self.__dict__[f"_{name}"] = self.server.clients.open(getattr(self.server.clients, f"new_{name}")())
        return found
