"""Plays scenarios one after the other, each on its own robots; keeps artifacts of failed ones; writes JUnit."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

from roboglot.hosting.escaping import xml_text
from roboglot.testing.artifacts import folder_of, save
from roboglot.testing.scenarios.checks import Checker
from roboglot.testing.scenarios.files import Found
from roboglot.testing.scenarios.steps import StepFailed, Steps
from roboglot.testing.server import RobotServer
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a scenario: ``failures`` in plain words (none: passed), duration (real s) and artifacts."""

    found: Found
    failures: Sequence[str]
    seconds: float
    left: Sequence[Path] = ()
    broken: bool = False  # it could not be played at all


def play(found: Found, leave: Path) -> Outcome:
    """Play one scenario; artifacts of a failed one go into a folder below ``leave``."""
    began = time.monotonic()  # noqa: TID251 - what CI shows as the test's time
    try:
        with RobotServer(found.scenario.given.wanted(found.path.parent)) as server:
            failures = _play_on(server, found)
            left: Sequence[Path] = ()
            if failures:
                left = save(server, folder_of(leave, found.path.stem), found.scenario.name, "\n".join(failures))
    except (OSError, ValueError) as error:
        return Outcome(found, [f"given: {error}"], time.monotonic() - began, broken=True)  # noqa: TID251
    return Outcome(found, failures, time.monotonic() - began, left)  # noqa: TID251


def _play_on(server: RobotServer, found: Found) -> Sequence[str]:
    checker = Checker(server)
    with contextlib.closing(Steps(server, checker, found.path.parent)) as steps:
        return _failures(steps, checker, found)


def _failures(steps: Steps, checker: Checker, found: Found) -> Sequence[str]:
    for number, step in enumerate(found.scenario.when, 1):
        try:
            steps.play(step)
        except StepFailed as failure:
            return [f"when {number}: {failure}"]
    wrong = ((number, checker.wrong(check)) for number, check in enumerate(found.scenario.then, 1))
    return [f"then {number}: {reason}" for number, reason in wrong if reason]


def play_all(all_found: Sequence[Found], leave: Path, report: Callable[[Outcome], None]) -> Sequence[Outcome]:
    """Play them in order; ``report`` is called after each."""
    outcomes: list[Outcome] = []
    for found in all_found:
        outcomes.append(play(found, leave))
        report(outcomes[-1])
    return outcomes


def junit(outcomes: Sequence[Outcome]) -> bytes:
    """Return a JUnit report, with the artifacts of failed scenarios as attachments."""
    failed, broken = sum(bool(o.failures) and not o.broken for o in outcomes), sum(o.broken for o in outcomes)
    suite = ElementTree.Element(
        "testsuite",
        name="roboglot",
        tests=str(len(outcomes)),
        failures=str(failed),
        errors=str(broken),
        time=f"{sum(o.seconds for o in outcomes):.3f}",
    )
    for outcome in outcomes:
        names = {"classname": xml_text(str(outcome.found.path)), "name": xml_text(outcome.found.scenario.name)}
        case = ElementTree.SubElement(suite, "testcase", names, time=f"{outcome.seconds:.3f}")
        if outcome.failures:
            kind = "error" if outcome.broken else "failure"
            failure = ElementTree.SubElement(case, kind, message=xml_text(outcome.failures[0]))
            failure.text = xml_text("\n".join(outcome.failures))
        if outcome.left:
            lines = "\n".join(f"[[ATTACHMENT|{path}]]" for path in outcome.left)
            ElementTree.SubElement(case, "system-out").text = xml_text(lines)
    root = ElementTree.Element("testsuites")
    root.append(suite)
    document: bytes = ElementTree.tostring(root, "utf-8", xml_declaration=True)
    return document
