"""Examples without what they need: a sentence with the remedy, and no traceback."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from roboglot.testing.addresses import free_addresses

EXAMPLES = Path(__file__).parents[2] / "examples"
REMEDY = "certs --export phone"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("cyberdog_ask.py", "10001"), REMEDY),
        (("cyberdog_ask.py", "status"), REMEDY),  # the usage
        (("block_program.py",), REMEDY),
        (("cyberdog_video.py",), REMEDY),
        (("ci/courier.py",), "courier.py URL X Y"),
        (("ci/courier.py", f"http://{free_addresses(1)}:1448", "0.4", "0"), "does not answer"),
    ],
)
def test_examples_name_what_is_missing(words: tuple[str, ...], said: str, tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLES / words[0]), *words[1:]]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=180, check=False)
    assert (ended.returncode, "Traceback" in ended.stderr) == (1, False), ended.stderr
    assert said in ended.stderr
