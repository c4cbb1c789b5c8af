"""The CI kit: the script that GitHub's action and GitLab's template call, both files, and the sample app's tests."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from roboglot.recording.reader import read_recording
from roboglot.testing.addresses import free_addresses

ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "deploy/ci/robot"
ADDRESS = free_addresses(1)


def robot(folder: Path, *arguments: str, **more: str) -> str:
    environment = os.environ | {"ROBOGLOT_CI": str(folder / "ci"), "ROBOGLOT_VENV": sys.prefix} | more
    done = subprocess.run([ROBOT, *arguments], env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow  # a whole job; in short: test_named_version_is_installed
@pytest.mark.timeout(900)  # a hang; the robot and its app are patient, however busy the machine is
def test_job_starts_and_drives_a_robot_keeping_events(tmp_path: Path) -> None:
    address = robot(tmp_path, "up", ARGUMENTS=f"--address {ADDRESS} --no-console --world empty --speed 4").strip()
    try:
        assert address == ADDRESS
        with pytest.raises(AssertionError, match="a robot is up already"):
            robot(tmp_path, "up", ARGUMENTS="--world empty")  # it would take the place of the first, which then stays
        app = [sys.executable, str(ROOT / "examples/ci/courier.py"), f"http://{address}:1448", "0.4", "0.0", "800"]
        drove = subprocess.run(app, capture_output=True, text=True, check=False)
        assert drove.stdout.startswith("arrived"), drove.stderr
    finally:
        robot(tmp_path, "down")
    [recording] = (tmp_path / "ci/artifacts").glob("*.mcap")
    assert any("actions" in exchange.operation for exchange in read_recording(recording).exchanges)
    assert (tmp_path / "ci/artifacts/log.txt").exists()


@pytest.mark.slow
def test_job_fails_with_the_reason_of_its_robot(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="nowhere"):
        robot(tmp_path, "up", ARGUMENTS="--world nowhere")


@pytest.mark.parametrize(("world", "status"), [("nowhere", 1), pytest.param("empty", 0, marks=pytest.mark.slow)])
def test_gitlabs_job_goes_on_only_with_a_robot(tmp_path: Path, world: str, status: int) -> None:
    """Run the template's lines as a runner does; what is installed is there already."""
    template = yaml.safe_load((ROOT / "deploy/ci/gitlab.yml").read_text())[".roboglot"]
    before = [line for line in template["before_script"] if " install " not in line]
    given = {**template["variables"], "ROBOGLOT": str(ROOT), "ROBOGLOT_VENV": sys.prefix}
    given |= {"CI_PROJECT_DIR": str(tmp_path), "ROBOGLOT_CI": str(tmp_path / "roboglot-ci")}
    given["ARGUMENTS"] = f"--address {ADDRESS} --no-console --world {world}"
    script = "\n".join(["set -eo pipefail", *before, 'echo "the robot is at $ROBOGLOT_ADDRESS"'])
    shell = ["bash", "-c"]
    try:
        done = subprocess.run(
            [*shell, script],
            env=os.environ | given,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=180,
            check=False,
        )
    finally:
        ended = subprocess.run(
            [*shell, "\n".join(template["after_script"])],
            env=os.environ | given,
            cwd=tmp_path,
            capture_output=True,
            timeout=180,
            check=False,
        )
    assert (done.returncode, ended.returncode) == (status, 0), done.stderr
    assert (f"the robot is at {ADDRESS}" in done.stdout) is (status == 0)


@pytest.mark.parametrize(
    ("what", "wanted"),
    [
        ("roboglot", "{here}/roboglot[up,testing]"),  # as in GitLab's template: pip takes a bare name for a project
        ("r.whl", "{here}/r.whl[up,testing]"),
        ("0.3", "roboglot[up,testing]==0.3"),
        ("git+https://host/roboglot", "roboglot[up,testing] @ git+https://host/roboglot"),
    ],
)
def test_named_version_is_installed(tmp_path: Path, what: str, wanted: str) -> None:
    (tmp_path / "roboglot").mkdir()
    (tmp_path / "r.whl").touch()
    python = tmp_path / "venv/bin/python"
    python.parent.mkdir(parents=True)
    python.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" >>{tmp_path}/called\n')
    python.chmod(0o755)
    robot(tmp_path, "install", what, ROBOGLOT_VENV=str(tmp_path / "venv"))
    assert wanted.format(here=tmp_path) in (tmp_path / "called").read_text().splitlines()


def test_action_and_template_call_what_is_there() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    steps = action["runs"]["steps"]
    called = {found for step in steps for found in re.findall(r'deploy/ci/robot" (\w+)', step.get("run", ""))}
    assert called == {"install", "up", "test", "down"}
    used = set(re.findall(r"inputs\.(\w+)", (ROOT / "action.yml").read_text()))
    assert used == set(action["inputs"])
    template = yaml.safe_load((ROOT / "deploy/ci/gitlab.yml").read_text())[".roboglot"]
    lines = " ".join((*template["before_script"], *template["after_script"]))
    assert set(re.findall(r'deploy/ci/robot" (\w+)', lines)) == {"install", "up", "down"}
    workflow = yaml.safe_load((ROOT / ".github/workflows/check.yml").read_text())
    assert workflow["jobs"]["action"]["steps"][-1]["with"] == {"do": "down"}


@pytest.mark.slow  # runs a test suite of its own; test_scenarios.py plays the sample
def test_the_sample_apps_tests_pass_side_by_side(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples/ci", tmp_path / "app")
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider"]
    done = subprocess.run(command, cwd=tmp_path / "app", capture_output=True, text=True, timeout=300, check=False)
    assert "20 passed" in done.stdout, done.stdout + done.stderr
