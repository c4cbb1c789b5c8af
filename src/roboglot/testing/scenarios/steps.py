"""Steps of a scenario: each does one thing, and raises StepFailed if the result is not the expected one."""

from __future__ import annotations

import contextlib
import http.client
import json
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from roboglot.clients.errors import ClientError
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Pose
from roboglot.testing.blocking import Blocking
from roboglot.testing.programs import ProgramFailed
from roboglot.testing.scenarios.checks import Checker
from roboglot.testing.scenarios.commands import Commands, NotEnded
from roboglot.testing.scenarios.files import STEPS, BadScenario, Step, fault_of, verb_of
from roboglot.testing.server import NotInTime, RobotServer
from roboglot.text_files import text_of

SHOWN_MAX = 2000  # characters of its end shown after a failure
ANSWER_MAX = 16 << 20


class StepFailed(AssertionError):
    """A step did not have the expected result; the message names the actual one."""


class Steps:
    """Plays the steps of one scenario."""

    def __init__(self, server: RobotServer, checker: Checker, folder: Path) -> None:
        self._server, self._checker, self._folder = server, checker, folder
        self._clients: dict[str, Blocking] = {}
        self._commands = Commands(folder, self.environment)
        self._verbs: Mapping[str, Callable[[Step], None]] = {name: getattr(self, f"_{name}") for name in STEPS}

    def play(self, step: Step) -> None:
        """Play one step. Raises StepFailed."""
        verb = verb_of(step, STEPS)
        try:
            self._verbs[verb](step)
        except (ClientError, RobotError, ProgramFailed, NotInTime, TimeoutError, ValueError, OSError) as error:
            raise StepFailed(f"{verb}: {error or type(error).__name__}") from None

    def close(self) -> None:
        """End what commands have left running, in whichever session."""
        self._commands.close()

    def environment(self) -> dict[str, str]:
        """Return a command's environment, with variables that point to the robots."""
        server, found = self._server, dict(os.environ)
        for name, address in server.addresses.items():
            found[f"ROBOGLOT_ADDRESS_{name.upper()}"] = address
        found |= {
            "ROBOGLOT_ADDRESS": server.address,
            "ROBOGLOT_URL": server.url,
            "ROBOGLOT_PROGRAMS": server.programs_url.removesuffix("/programs"),
            "ROBOGLOT_APP_PORT": str(server.app_port),
        }
        with contextlib.suppress(ImportError, OSError):
            server.clients.certificates()
            found["ROBOGLOT_CERTIFICATES"] = str(server.data / "app")
        return found

    def _run(self, step: Step) -> None:
        command = step.run or ""
        try:
            status, output = self._commands.run(command, step.within)
        except NotEnded as late:
            raise StepFailed(f"{command!r} has not ended after {step.within:g} s\n{str(late)[-SHOWN_MAX:]}") from None
        self._checker.printed += output.splitlines()
        if status:
            raise StepFailed(f"{command!r} ended with {status}\n{output[-SHOWN_MAX:]}")

    def _rest(self, step: Step) -> None:
        method, _, path = (step.rest or "").partition(" ")
        body = None if step.body is None else json.dumps(step.body)
        host = self._server.addresses[step.robot] if step.robot else self._server.address
        port = self._server.config.doors["slamware"].port
        with contextlib.closing(http.client.HTTPConnection(host, port, timeout=step.within)) as connection:
            connection.request(method, path.strip(), body, {"Content-Type": "application/json"} if body else {})
            response = connection.getresponse()
            data = response.read(ANSWER_MAX)
        wanted = step.status or 200
        if response.status != wanted and (step.status is not None or response.status >= 400):
            raise StepFailed(
                f"{step.rest}: {response.status}, not {wanted}: {data[:SHOWN_MAX].decode(errors='replace')}"
            )
        if step.answer is not None and not _has(json.loads(data or b"null"), step.answer):
            raise StepFailed(f"{step.rest} answered {data[:SHOWN_MAX].decode(errors='replace')}, not {step.answer}")

    def _text(self, step: Step) -> None:
        answer = self._client("robomaster", step.robot).ask(step.text, step.within)
        if answer != (wanted := "ok" if step.answer is None else str(step.answer)):
            raise StepFailed(f"{step.text!r} was answered {answer!r}, not {wanted!r}")

    def _dog(self, step: Step) -> None:
        from roboglot.wire.cyberdog.codes import Code

        code = Code(step.dog or 0)
        answers = list(self._client("cyberdog", step.robot).answers(code, step.body or {}))
        if step.answer is not None and not any(_has(json.loads(text or "null"), step.answer) for text in answers):
            raise StepFailed(f"{step.dog} was answered {answers}, not {step.answer}")

    def _program(self, step: Step) -> None:
        source = text_of(self._folder / (step.program or ""))
        run = self._client("program", step.robot).run(source, within=step.within)
        self._checker.printed += run.printed

    def _fault(self, step: Step) -> None:
        fault = fault_of(step.fault or "")
        self._server.stage.inject_fault(fault.kind, fault.robot, **dict(fault.options))

    def _clear_faults(self, _: Step) -> None:
        self._server.stage.clear_fault()

    def _place(self, step: Step) -> None:
        assert step.place is not None
        name = step.place.robot or next(iter(self._server.addresses))
        self._server.stage.place(name, Pose(step.place.x, step.place.y, math.radians(step.place.degrees)))

    def _box(self, step: Step) -> None:
        assert step.box is not None
        box = step.box
        self._server.stage.add_obstacle(Pose(box.x, box.y, 0.0), (box.width, box.depth, box.height))

    def _wait(self, step: Step) -> None:
        self._server.forward(step.wait or 0.0)

    def _until(self, step: Step) -> None:
        assert step.until is not None
        end, wrong = self._server.time + step.within, self._checker.wrong(step.until)
        while wrong:
            if self._server.time >= end:
                raise StepFailed(f"not within {step.within:g} s: {wrong}")
            self._server.forward(0.1)
            wrong = self._checker.wrong(step.until)

    def _client(self, kind: str, robot: str) -> Blocking:
        if (found := self._clients.get(kind + robot)) is None:
            if robot and robot not in self._server.addresses:
                raise BadScenario(f"there is no robot {robot!r}")
            made = getattr(self._server.clients, f"new_{kind}")(robot)
            found = self._clients[kind + robot] = self._server.clients.open(made)
        return found


def _has(have: object, wanted: object) -> bool:
    """Return whether ``have`` contains at least ``wanted``."""
    if isinstance(wanted, dict):
        return isinstance(have, dict) and all(key in have and _has(have[key], value) for key, value in wanted.items())
    if isinstance(wanted, list):
        return isinstance(have, list) and len(have) == len(wanted) and all(map(_has, have, wanted))
    if isinstance(wanted, float) and isinstance(have, (int, float)):
        return math.isclose(have, wanted, rel_tol=1e-6, abs_tol=1e-9)
    return type(have) is type(wanted) and bool(have == wanted)
