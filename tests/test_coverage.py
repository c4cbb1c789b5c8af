"""The coverage page says what the code says."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from roboglot.cli.coverage import CONTRACTS, measure, page

TOTALS = {
    "slamware": 167,
    "robomaster": 66,
    "cyberdog": 71,
    "visual": 169,
    "visual_frames": 203,
    "vda5050": 34,
    "vda5050_messages": 27,
    "foxglove": 14,
    "foxglove_messages": 15,
    "ros2": 3,
    "ros2_messages": 11,
}


@pytest.mark.parametrize("protocol", CONTRACTS)
def test_the_contract_is_whole(protocol: str) -> None:
    keys = [row.key for row in CONTRACTS[protocol].rows()]
    assert len(keys) == len(set(keys)) == TOTALS[protocol]


def test_the_page_is_up_to_date() -> None:
    written = (Path(__file__).parents[1] / "docs" / "coverage.md").read_text(encoding="utf-8")
    assert written == page({name: measure(contract) for name, contract in CONTRACTS.items()}), (
        "run: roboglot coverage --write"
    )


def test_nothing_is_whole_and_partial_at_once() -> None:
    for contract in CONTRACTS.values():
        coverage = measure(contract)
        assert not coverage.done & coverage.partly.keys()


def test_the_numbers_as_json() -> None:
    command = [sys.executable, "-m", "roboglot", "coverage", "--json"]
    numbers = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert {name: row["total"] for name, row in numbers.items()} == TOTALS
    for row in numbers.values():
        assert row["done"] + len(row["missing"]) == row["total"]
