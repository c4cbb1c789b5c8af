"""Scenario files: read strictly, played on real ports, judged by the truth; JUnit and artefacts of those that fail."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from roboglot.hosting.process import has_ended
from roboglot.testing.scenarios.files import BadScenario, find, read, schema

SAMPLE = Path(__file__).parents[2] / "examples/ci"
WRONG = {
    "name: x": "when is missing",
    "name: x\nwhen: []\nthen: []\n": "then must have at least 1 entries",
    "name: x\nwhen: []\nthen: [{moved: {z: 1}}]\n": "z is unknown",
    "name: x\nwhen: []\nthen: [{refusd: 0}]\n": "refusd is unknown; did you mean 'refused'",
    "name: x\nwhen: [{run: a, text: b}]\nthen: [{refused: 0}]\n": "when 1: one of run, rest",
    "name: x\nwhen: [{within: 3}]\nthen: [{refused: 0}]\n": "not none",
    "name: x\nwhen: [{until: {}}]\nthen: [{refused: 0}]\n": "when 1: until: one of pose",
    "name: x\nwhen: []\nthen: [{battery: {at_least: 3, robot: b}}]\n": "no robot 'b'; there are a",
    "name: x\nwhen: []\nthen: [{refused: 0}]\ngiven: {robots: []}\n": "robots must have at least 1 entries",
    "name: x\nwhen: []\nthen: [{refused: 0}]\nthen: [{refused: 1}]\n": "'then' is given twice in .* line 4",
    "name: x\nwhen: []\nthen: [{moved: {x: 1, x: 2}}]\n": "'x' is given twice",
    "name: x\nwhen: []\nthen: [{travelled: {at_most: .nan}}]\n": ".nan is not a finite number in .* line 3",
    "name: x\nwhen: []\nthen: [{pose: {x: 0, within: .inf}}]\n": ".inf is not a finite number",
    "name: x\nwhen: []\nthen: [{travelled: {}}]\n": "then 1: at_least or at_most is needed",
    "name: x\nwhen: []\nthen: [{exchanged: {at_least: 0}}]\n": "then 1: at_most, or at_least above 0, is needed",
    "name: x\nwhen: []\nthen: [{printed: ''}]\n": "then 1: a text is needed",
    "name: x\nwhen: [{until: {pose: {robot: a}}}]\nthen: [{refused: 0}]\n": "until: x, y or degrees is needed",
    "name: x\nwhen: !!int ''\n": "a value does not fit its tag",
    "name: x\nwhen: !!bool maybe\n": "a value does not fit its tag",
    "? [a, b]\n: c": "unhashable key",
    "a: [": "while parsing",
    "!!python/object/apply:os.system [true]": "constructor",
}


@pytest.mark.parametrize("text", WRONG)
def test_invalid_scenarios_are_refused_with_their_place(tmp_path: Path, text: str) -> None:
    file = tmp_path / "x.yaml"
    file.write_text(text)
    with pytest.raises(BadScenario, match=WRONG[text]) as refused:
        read(file)
    assert str(refused.value).startswith(f"{file}: ")
    assert "\n" not in str(refused.value)


def test_an_empty_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadScenario, match="no scenario"):
        find([tmp_path])


def test_the_samples_schema_is_that_of_the_code() -> None:
    assert json.loads((SAMPLE / "scenario.schema.json").read_text()) == json.loads(json.dumps(schema()))


PASSES = """
name: it drives by text
given: {world: empty}
when:
  - text: chassis move x 0.3 wait_for_complete true
  - dog: 5001
    body: {}
  - program: hello.py
  - run: test -n "$ROBOGLOT_CERTIFICATES" && echo "at $ROBOGLOT_ADDRESS"
  - rest: GET /api/core/nothing
    status: 404
  - fault: {kind: low_battery, charge: 0.1}
  - until: {battery: {at_most: 10.5}}
    within: 5
then:
  - moved: {x: 0.3, y: 0.0}
  - travelled: {at_least: 0.25, at_most: 1}
  - printed: hello
  - printed: at 127.
  - exchanged: {door: slamware, status: "404", at_most: 1}
"""
FAILS = """
name: it does not drive & "quotes"
given: {world: empty}
when:
  - wait: 0.2
then:
  - moved: {x: 1.0}
  - refused: 0
  - printed: never
"""
STOPS = """
name: a step fails
given: {world: empty}
when:
  - rest: GET /api/core/nothing
then: [{refused: 0}]
"""
BROKEN = "name: no such world\ngiven: {world: nowhere}\nwhen: []\nthen: [{refused: 0}]\n"


@pytest.mark.slow
def test_scenarios_are_played_and_reported(tmp_path: Path) -> None:
    folder = tmp_path / "scenarios"
    folder.mkdir()
    (folder / "hello.py").write_text("print('hello')\n")
    for name, text in (("a", PASSES), ("b", FAILS), ("c", STOPS), ("d", BROKEN)):
        (folder / f"{name}.yaml").write_text(text)
    command = [sys.executable, "-m", "roboglot", "test", str(folder), "--junit", str(tmp_path / "out/j.xml")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "ok     it drives by text" in done.stdout
    assert "1 of 4 scenarios passed" in done.stdout
    assert "then 1: moved: x is 0.000, not 1.000" in done.stdout
    assert "then 3: printed: 'never' was not printed" in done.stdout
    assert "when 1: GET /api/core/nothing: 404, not 200" in done.stdout
    suite = ElementTree.parse(tmp_path / "out/j.xml").getroot()[0]
    assert {key: suite.get(key) for key in ("tests", "failures", "errors")} == {
        "tests": "4",
        "failures": "2",
        "errors": "1",
    }
    assert suite[1].get("name") == 'it does not drive & "quotes"'
    assert (tmp_path / "roboglot-failures/b/recording.mcap").stat().st_size > 1000
    assert (tmp_path / "roboglot-failures/b/exchanges.html").exists()
    assert "[[ATTACHMENT|" in (suite[1].findtext("system-out") or "")


def test_leftovers_of_a_command_end_with_its_scenario(tmp_path: Path) -> None:
    """It would disturb the next one, and outlive all of them."""
    (tmp_path / "leaves.yaml").write_text(
        "name: it leaves one\ngiven: {world: empty, lockstep: true}\n"
        "when:\n  - run: env -i setsid sh -c 'echo $$ >left; exec sleep 3600' >/dev/null 2>&1 &\n"
        "  - run: until test -s left; do sleep 0.01; done; kill -0 $(cat left)\n"
        "then: [{travelled: {at_most: 1}}]\n"
    )
    command = [sys.executable, "-m", "roboglot", "test", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert has_ended(int((tmp_path / "left").read_text()))
