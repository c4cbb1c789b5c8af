"""Each sample of a file in the pages is one that the program accepts: settings, worlds, missions, scenarios, orders."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from roboglot.config import Config, config_of, load_config
from roboglot.console.studio import lessons
from roboglot.protocols import DOORS, sections
from roboglot.recording.comparing.masks import read_mask
from roboglot.simulation.world.world_files import load_world
from roboglot.testing.scenarios import files as scenarios
from roboglot.wire.vda5050.orders import OrderMessage, read
from tests.docs.test_docs import FENCE, PAGES, ROOT
from tests.docs.test_docs_commands import refusal

FLOOR = '[[floors]]\nname = "floor"\nsize = [30, 20]\n'
SETTINGS = {field.name for field in fields(Config)} | sections().keys()
SAMPLES = [
    pytest.param(language, code, id=f"{page.relative_to(ROOT)}-{number}")
    for page in PAGES
    for number, (language, code) in enumerate(FENCE.findall(page.read_text("utf-8")))
    if language in ("toml", "yaml", "json")
]


def world_of(code: str) -> str:
    """Return a whole world of a page's part of one."""
    if "[[floors]]" not in code:
        person = f"people = [{{ path = [[1, 1]], {code.strip()} }}]\n"
        return 'name = "sample"\n' + FLOOR + (person if code.startswith("script") else code)
    whole = re.search(r"^size = ", code, re.MULTILINE)
    return code if whole else 'name = "sample"\n' + code.replace("[[floors]]\n", FLOOR)


def check_toml(code: str, file: Path) -> None:
    values = tomllib.loads(code)
    read: Callable[[Path], object]
    if values.keys() <= SETTINGS:
        read = lambda path: load_config(path, {}, sections())  # noqa: E731
    elif values.keys() & {"floors", "faults", "script"}:
        code, read = world_of(code), load_world
    elif "check" in values:
        read = lambda path: lessons.read(path.read_text("utf-8"))  # noqa: E731
    else:
        read = read_mask
    file.write_text(code, "utf-8")
    read(file)


def check_yaml(code: str, file: Path) -> None:
    values = yaml.safe_load(code)
    file.write_text(code, "utf-8")
    if "given" in values:
        assert scenarios.read(file).scenario.then
    elif "scrape_configs" in values:  # Prometheus's
        assert re.fullmatch(r"127\.0\.0\.1:\d+", values["scrape_configs"][0]["static_configs"][0]["targets"][0])
    else:  # a GitHub action's steps
        known = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))["inputs"]
        used = [step["with"] for step in values["steps"] if "roboglot" in step.get("uses", "")]
        assert len(used) > 1
        assert {name for inputs in used for name in inputs} <= known.keys()


def check_json(code: str, file: Path) -> None:
    values: dict[str, Any] = json.loads(code)
    if "mcpServers" in values:
        for server in values["mcpServers"].values():
            assert server["command"] == "roboglot"
            assert not refusal(shlex.join(server["args"]))
    elif "plan" in values:
        assert {step["do"] for step in values["plan"]} <= {"go_to", "drive"}
    else:
        assert read(code.encode(), OrderMessage).order_id


@pytest.mark.parametrize(("language", "code"), SAMPLES)
def test_sample_is_accepted(language: str, code: str, tmp_path: Path) -> None:
    check = {"toml": check_toml, "yaml": check_yaml, "json": check_json}[language]
    check(code, tmp_path / f"sample.{language}")


def test_an_agents_port_is_no_doors() -> None:
    """`up` has its doors open on the same address."""
    config = config_of({}, doors=sections(), origin="")
    taken = {port for door in DOORS for port in door.port_numbers(config).values()}
    assert 8765 in taken
    ports = re.findall(r"--http (\d+)", (ROOT / "docs/operation/mcp.md").read_text("utf-8"))
    assert ports
    assert not {*map(int, ports)} & taken


def test_a_wrong_sample_is_found(tmp_path: Path) -> None:
    for wrong in ("[ros2]\ndead_men = 1\n", "[[floors]]\nmarkers = [{ mark = '1' }]\n", "tolerance = 'x'\n"):
        with pytest.raises(ValueError):  # noqa: PT011  # each reader has words of its own
            check_toml(wrong, tmp_path / "sample.toml")
