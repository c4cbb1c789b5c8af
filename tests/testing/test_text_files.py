"""Files that people write, from a stranger: every reader refuses monstrous ones in plain words."""

from pathlib import Path

import pytest

from roboglot.config import load_config
from roboglot.console.studio import lessons
from roboglot.recording.comparing.masks import read_mask
from roboglot.simulation.bodies.files import load_body
from roboglot.simulation.world.world_files import load_world
from roboglot.testing.scenarios import files as scenarios

TOML = {"deep": f"x = {'[' * 1000}", "long": f"x = {'9' * 5000}"}
YAML = {"deep": "[" * 500, "long": f"name: {'9' * 5000}", "no date": "name: 2001-99-99"}
WORDS = {"deep": "nested too deeply", "long": "too many digits", "no date": "month"}
TOML_READERS = {
    "world": load_world,
    "body": lambda path: load_body(str(path)),
    "settings": lambda path: load_config(path, {}),
    "mask": read_mask,
    "mission": lambda path: lessons.read(path.read_text()),
}
YAML_READERS = {"world": load_world, "scenario": scenarios.read}


@pytest.mark.parametrize("reader", TOML_READERS)
@pytest.mark.parametrize("kind", TOML)
def test_monstrous_toml_is_refused(tmp_path: Path, kind: str, reader: str) -> None:
    path = tmp_path / "x.toml"
    path.write_text(TOML[kind])
    with pytest.raises(ValueError, match=WORDS[kind]):
        TOML_READERS[reader](path)


@pytest.mark.parametrize("reader", YAML_READERS)
@pytest.mark.parametrize("kind", YAML)
def test_monstrous_yaml_is_refused(tmp_path: Path, kind: str, reader: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(YAML[kind])
    with pytest.raises((ValueError, scenarios.BadScenario), match=WORDS[kind]):
        YAML_READERS[reader](path)
