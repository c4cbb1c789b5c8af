"""Both pages of the configuration file have all settings, with their defaults."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from roboglot.config import Config, RobotConfig, StartConfig, load_config
from roboglot.protocols import DOORS, sections

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(params=["settings.md", "settings.zh.md"])
def shown(request: pytest.FixtureRequest) -> str:
    found = re.search(r"```toml\n(.*?)```", (DOCS / request.param).read_text("utf-8"), re.DOTALL)
    assert found
    return found[1]


def test_settings_are_shown_with_their_defaults(shown: str, tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text(shown, "utf-8")
    loaded, usual = load_config(file, {}, sections()), load_config(None, {}, sections())
    assert dataclasses.replace(loaded, doors={}) == usual
    assert loaded.doors == {door.name: door.config() for door in DOORS}
    optional = re.sub(r"^# (?=\w+ = )", "", shown, flags=re.MULTILINE)
    file.write_text(optional, "utf-8")
    assert load_config(file, {}, sections()).robots[0].start == StartConfig(1.0, 2.0, 1.57)


def test_no_setting_is_left_out(shown: str) -> None:
    """``data`` is in the text below, since its default is of the machine."""
    kinds = {"": Config, "robots": RobotConfig} | sections()
    config = Config()
    kinds |= {name: type(getattr(config, name)) for name in ("programs", "access", "console", "record")}
    kinds |= {"access.tls": type(config.access.tls)}
    parts = re.split(r"^\[+([\w.]+)\]+.*$", "[]\n" + shown, flags=re.MULTILINE)
    texts = {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}
    assert texts.keys() == kinds.keys()
    for section, kind in kinds.items():
        names = set(re.findall(r"^(?:# )?(\w+) = ", texts[section], re.MULTILINE))
        wanted = {field.name for field in dataclasses.fields(kind)} - {"data", "doors", "robots", "tls", *kinds}
        assert names == wanted | (names & {"tls"}), section
