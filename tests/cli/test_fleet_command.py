"""`roboglot fleet`: wrong settings end it in one sentence, and its answers name what was asked for."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import pytest

from roboglot.cli import fleet
from roboglot.shards import nursery_client
from roboglot.shards.plan import PLAN, plan_fleet, save
from roboglot.shards.requests import Answer, RobotRow, Row
from roboglot.shards.states import Shard, State
from roboglot.testing.addresses import free_addresses

TEMPLATE = 'world = "moon"\n'


class Hopeless:
    """A fleet none of whose worlds can start."""

    def __init__(self, folder: Path) -> None:
        self.plan, self.folder, self.closed = plan_fleet(2, 1, {}, folder, first=free_addresses(2)), folder, False
        self.shards = {plan.name: Shard(1, plan, folder) for plan in self.plan.shards}

    async def start(self) -> float:
        self.folder.mkdir(exist_ok=True)
        save(self.plan, self.folder)
        for shard in self.shards.values():
            shard.state, shard.hopeless, shard.reason = State.FAILED, True, "no world is named 'moon'"
        return 0.0

    async def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize("known", [False, True])
def test_fleet_without_a_world_leaves_no_plan(known: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nursery_client, "launched", lambda **_: nullcontext(None))
    host, template, folder = Hopeless(tmp_path / "f"), tmp_path / "class.toml", tmp_path / "f"
    template.write_text(TEMPLATE)
    monkeypatch.setattr(fleet, "_fleet_host", lambda *_: host)
    folder.mkdir()
    if known:
        save(host.plan, folder)
    with pytest.raises(SystemExit, match=r"^roboglot fleet: no world can start: no world is named 'moon'$"):
        fleet.up(worlds=0 if known else 2, template=None if known else template, data=folder)
    assert host.closed
    assert (folder / PLAN).exists() is known, "only a plan that was up before is kept"


@pytest.mark.parametrize(
    ("content", "reason"), [(None, "class.toml: No such file"), (b"a", "class.toml: "), (b"\xff", "class.toml: ")]
)
def test_unreadable_template_is_named(content: bytes | None, reason: str, tmp_path: Path) -> None:
    template = tmp_path / "class.toml"
    if content is not None:
        template.write_bytes(content)
    with pytest.raises(ValueError, match=reason) as refused:
        fleet._plan(tmp_path / "f", fleet._Asked(1, 1, template, ""), replan=False)
    assert "Errno" not in str(refused.value)


def test_fleet_has_a_world(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        fleet.app(["up", "--worlds", "0", "--data", str(tmp_path)])
    assert ended.value.code == 2
    assert "0 is not in the range x>=1" in " ".join(capsys.readouterr().err.split())


def test_folder_lies_in_the_data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOGLOT_DATA", str(tmp_path))
    assert fleet._folder(None) == tmp_path / "fleet"
    assert fleet._folder(tmp_path / "other") == tmp_path / "other"


@pytest.mark.parametrize(("name", "shown"), [("", ["w1", "w2"]), ("w2", ["w2"]), ("a1", ["w1"])])
def test_an_answer_shows_what_was_asked_for(name: str, shown: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    rows = [
        Row(f"w{n}", "ready", 1, [RobotRow(f"a{n}", "hermes", "")], 0.0, 0, 1.0, 0, 0.0, "", "", "") for n in (1, 2)
    ]
    fleet._print(Answer(rows, 1), name)
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == shown
