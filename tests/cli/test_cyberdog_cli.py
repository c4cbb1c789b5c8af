"""``roboglot cyberdog`` against a robot of its own: what it prints, what it leaves, how it fails."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.request import urlopen

import pytest

from roboglot.cli import cyberdog
from roboglot.testing.addresses import free_addresses, free_port
from roboglot.testing.process import served

ADDRESS = free_addresses(1)
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    data = tmp_path_factory.mktemp("robot") / "data"
    port = str(free_port())
    arguments = ("--robot", "a=cyberdog2", "--world", "playground", "--app", f"127.0.0.1:{port}")

    def command(*words: str, cwd: str | None = None, input: str | None = None) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-m", "roboglot", "cyberdog", *words, "--app-port", port, "--robot", ADDRESS]
        environment = {**os.environ, "ROBOGLOT_DATA": str(data)}
        return subprocess.run(line, capture_output=True, text=True, timeout=180, env=environment, cwd=cwd, input=input)

    with served(data, *arguments, address=ADDRESS):
        wait_for_map()
        yield command


def wait_for_map() -> None:
    """Wait until the robot has mapped something: on a busy machine its lidar may take long to turn once."""
    deadline = time.monotonic() + 120.0
    while True:
        with urlopen(f"http://{ADDRESS}:1448/api/core/slam/v1/knownarea", timeout=60) as reply:
            if json.load(reply)["width"] > 0:
                return
        assert time.monotonic() < deadline
        time.sleep(0.1)


def test_status_is_json(run: Run) -> None:
    reported = json.loads(run("status").stdout)
    assert reported["task_status"]["task_status"] == 101
    assert reported["bat_info"]["power"] > 0


def test_a_photo_is_left_here(run: Run, tmp_path: Path) -> None:
    run("photo", "door.jpg", cwd=str(tmp_path))
    assert (tmp_path / "door.jpg").read_bytes()[:2] == b"\xff\xd8"


def test_hostile_robot_does_not_place_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.jpg").write_text("mine")
    assert cyberdog._here("20261128_120000.jpg") == "20261128_120000.jpg"
    assert cyberdog._here("/etc/cron.d/x.jpg") == cyberdog._here("..\\..\\x.jpg") == "x.jpg"
    for name in ("", "..", "/etc/", ".bashrc", "a/.bashrc", "x\x1b[2J.jpg", "mine.jpg", "there/mine.jpg"):
        with pytest.raises(OSError, match="the robot calls the file"):
            cyberdog._here(name)


def test_photo_that_cannot_be_written_is_not_taken(run: Run, tmp_path: Path) -> None:
    for name in (str(tmp_path), str(tmp_path / "absent" / "a.jpg")):
        failed = run("photo", name)
        assert failed.returncode == 1
        assert failed.stderr.startswith("roboglot cyberdog: cannot write ")


@pytest.mark.slow
def test_go_reports_arrival_and_map_saves(run: Run) -> None:
    went = run("go", "0.6", "0.0")
    assert "308 arrived" in went.stdout
    far = run("go", "-300", "300")
    assert (far.returncode, "306" in far.stderr) == (1, True)
    assert "saved as home" in run("map", "home", input="\n").stdout


@pytest.mark.parametrize(
    "words",
    [
        ["fly"],
        ["go", "1"],
        ["drive"],
        ["drive", "nan", "0", "0", "1"],
        ["drive", "0.1", "0", "0", "-1"],
        ["record", "0"],
        ["status", "--certs", "/nowhere"],
    ],
)
def test_mistakes_are_reported_in_a_line(run: Run, words: list[str]) -> None:
    failed = run(*words)
    assert failed.returncode == 1
    assert failed.stderr.startswith("roboglot cyberdog: ")
    assert "Traceback" not in failed.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["stand", "--robt", "127.0.0.9"], "there is no option '--robt'; did you mean '--robot'?"),
        (["stand", "--robt=127.0.0.9"], "there is no option '--robt=127.0.0.9'; did you mean '--robot'?"),
        (["lie", "-r", "127.0.0.9"], f"there is no option '-r'; there are {', '.join(cyberdog.OPTIONS)}"),
        (["stand", "127.0.0.9"], "stand takes no words, not '127.0.0.9'"),
        (["photo", "a.jpg", "127.0.0.9"], "photo takes at most 1 word, not 'a.jpg 127.0.0.9'"),
    ],
)
def test_words_without_effect_move_no_robot(run: Run, words: list[str], said: str) -> None:
    """A mistyped --robot would move the robot at the default address."""
    failed = run(*words)
    assert (failed.returncode, failed.stderr.splitlines()[0]) == (1, f"roboglot cyberdog: {said}")


@pytest.mark.slow
def test_certificates_of_another_robot_are_named(run: Run, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "roboglot", "certs", "--export", str(tmp_path), "--data", str(tmp_path / "other")]
    subprocess.run(command, check=True, capture_output=True, timeout=180)
    failed = run("status", "--certs", str(tmp_path))
    assert failed.returncode == 1
    said = f"roboglot cyberdog: the robot at {ADDRESS} has other certificates than {tmp_path}:"
    assert failed.stderr.startswith(said)
    assert "--data" in failed.stderr
