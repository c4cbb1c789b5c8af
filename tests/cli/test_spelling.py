"""Guesses for mistyped names: near ones, and none for words that resemble nothing."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from roboglot import cli
from roboglot.cli import COMMANDS
from roboglot.config import config_of
from roboglot.simulation.faults.fault_kinds import KINDS
from roboglot.spelling import instead, nearest

OPTIONS = ("--seed", "--speed", "--data", "--uart", "--record", "--insecure", "--robot", "--world")
FUNCTIONS = ("cyberdog.motion.turn", "cyberdog.motion.jump_back", "cyberdog.led.show")
ROBOTS = ("a", "dog1", "dog2", "kitchen")
BODIES = ("cyberdog2", "hermes", "robomaster_ep", "universal")


@pytest.mark.parametrize(
    ("word", "known", "near"),
    [
        ("recrod", COMMANDS, "record"),  # codespell:ignore
        ("conect", COMMANDS, "connect"),  # codespell:ignore
        ("sotp", COMMANDS, "stop"),
        ("camp", COMMANDS, "campaign"),
        ("MIRROR", COMMANDS, "mirror"),
        ("pu", COMMANDS, "up"),
        ("--sede", OPTIONS, "--seed"),
        ("--spede", OPTIONS, "--speed"),
        ("-seed", OPTIONS, "--seed"),
        ("low_batery", KINDS, "low_battery"),
        ("lowbattery", KINDS, "low_battery"),
        ("cyberdog.motion.trun", FUNCTIONS, "cyberdog.motion.turn"),
        ("cyberdog.motion.jumpback", FUNCTIONS, "cyberdog.motion.jump_back"),
        ("kichen", ROBOTS, "kitchen"),
        ("hermess", BODIES, "hermes"),
        ("cyberdog", BODIES, "cyberdog2"),
        ("robomaster", BODIES, "robomaster_ep"),
    ],
)
def test_typo_finds_its_name(word: str, known: tuple[str, ...], near: str) -> None:
    assert nearest(word, known) == near
    assert instead(word, known) == f"; did you mean {near!r}?"


@pytest.mark.parametrize(
    ("word", "known"),
    [
        *((word, COMMANDS) for word in ("zebra", "list", "robots", "install", "x", "", "--", "?" * 9999)),
        *((word, OPTIONS) for word in ("--lidar", "--driver", "--zzz", "--port")),
        ("cyberdog.motion.fly", FUNCTIONS),  # the common beginning is no resemblance
        ("dog3", ROBOTS),  # another robot, not a misspelt one
        ("b", ROBOTS),
        ("spot", BODIES),
        ("anything", ()),
    ],
)
def test_word_without_near_name_gets_no_guess(word: str, known: tuple[str, ...]) -> None:
    assert nearest(word, known) == ""
    assert instead(word, known) == f"; there are {', '.join(known)}"


@pytest.mark.parametrize(
    ("line", "said", "unsaid"),
    [
        ("up --sede 3", "--seed", "--insecure"),
        ("up --lidar", "--lidar", "Possible"),
        ("record staus", "did you mean 'status'?", "Did you mean"),  # codespell:ignore
        ("fleet zebra", "there are up,", "id you mean"),
        ("recrod", "there is no command 'recrod'; did you mean 'record'?", "there are"),  # codespell:ignore
    ],
)
def test_command_line_guesses_well(line: str, said: str, unsaid: str) -> None:
    command = [sys.executable, "-m", "roboglot", *line.split()]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=180)
    assert done.returncode != 0
    shown = " ".join(done.stderr.replace("│", " ").split())
    assert said in shown
    assert unsaid not in shown


def test_mistyped_setting_is_named_with_the_right_one() -> None:
    with pytest.raises(ValueError, match=r"worldx is not a setting; did you mean 'world'\?$"):
        config_of({"worldx": "office"})


def test_a_misspelt_variable_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["roboglot", "--version"])
    for name in ("AXCESS", "DATA_BASE", "INSECURE", "CI", "ADDRESS_B", "TESTS_COLD", "KILLS", "URL", "ORDERS"):
        monkeypatch.setenv(f"ROBOGLOT_{name}", "secret")
    cli.main()
    assert capsys.readouterr().err.splitlines() == [
        "roboglot: ROBOGLOT_AXCESS has no effect; did you mean ROBOGLOT_ACCESS?",
        "roboglot: ROBOGLOT_DATA_BASE has no effect; did you mean ROBOGLOT_DATABASE?",
    ]


def test_all_variables_that_are_read_are_known() -> None:
    read: set[str] = set()
    for path in Path(cli.__file__).parents[1].rglob("*.py"):
        read.update(re.findall(r'"ROBOGLOT_([A-Z_]+)"', path.read_text()))
    given = {"ADDRESS", "URL", "PROGRAMS", "CERTIFICATES", "APP_PORT"}  # to the commands of scenarios, which read them
    given |= {"SCENARIO", "CAMPAIGN_FOLDER"}  # to processes that are to be ended, or that end them
    assert read - given | {"PROGRAMS"} == set(cli.VARIABLES)
