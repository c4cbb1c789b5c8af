"""The capability page is what the code says."""

from pathlib import Path

import pytest

from roboglot.cli.capabilities import DRIVERS, PAGE, RobotKind, page
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.protocols import DOORS

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module", name="text")
def made_page() -> str:
    """Making it takes a second or two."""
    return page()


def test_the_page_is_current(text: str) -> None:
    assert (ROOT / PAGE).read_text(encoding="utf-8") == text, "run: roboglot capabilities --write"


def test_verdicts() -> None:
    kind = RobotKind("some", frozenset({Base, Driving}), {Base: "in pulses"})
    assert kind.judge(frozenset({Driving})) == "exact"
    assert kind.judge(frozenset({Driving, Base})) == "nearly"
    assert kind.judge(frozenset({Gimbal})) == "refused"


def test_refused_requests_are_listed_with_their_reason(text: str) -> None:
    section = text.partition("### Requests of robomaster that real robots refuse")[2].partition("\n## ")[0]
    (row,) = [line for line in section.splitlines() if "`blaster.fire`" in line]
    assert row.endswith("| no Blaster |  | no Blaster |")
    for protocol in (door.name for door in DOORS):
        chapters, _, refused = text.partition(f"\n## {protocol}\n")[2].partition("\n## ")[0].partition("### Requests")
        rows = [
            [cell.strip() for cell in line.split("|")[1:-1]]
            for line in refused.splitlines()[4:]
            if line.startswith("|")
        ]
        for column, name in enumerate(DRIVERS, 1):
            listed = sum(row[0].count("`") // 2 for row in rows if row[column])
            cells = [line.split("|")[-5 + column].split()[0].split("/") for line in chapters.splitlines()[3:] if line]
            assert listed == sum(int(of) - int(done) for done, of in cells), (protocol, name)


def test_drivers_add_the_components_they_announce(text: str) -> None:
    """Components except those that autonomy adds, and those that only some robots have."""
    for name in DRIVERS:
        assert f"## Approximate parts of `{name}`" in text
