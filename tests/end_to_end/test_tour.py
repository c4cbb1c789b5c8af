"""The demo: four independent clients drive one robot, and all four say the same of where it is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from roboglot.testing.addresses import free_addresses

DEPOT = Path(__file__).parents[1] / "data" / "maps" / "depot.yaml"


@pytest.mark.timeout(1000)
@pytest.mark.slow  # a long story; tests/docs has the first call of each client
@pytest.mark.parametrize("world", ["office", str(DEPOT)], ids=["office", "depot"])
def test_four_clients_drive_one_robot(world: str, tmp_path: Path, vendor_ports: None) -> None:
    out = tmp_path / "tour.png"
    command = [sys.executable, "-m", "roboglot", "demo", "--world", world, "--speed", "6"]
    done = subprocess.run(
        [*command, "--address", free_addresses(1), "--out", str(out)],
        capture_output=True,
        text=True,
        timeout=900,  # a hang; robot and clients are patient, however busy the machine is
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("they agree") == 4
    with Image.open(out) as picture:
        assert min(picture.size) > 200
        assert len(set(picture.convert("RGB").get_flattened_data())) > 8
