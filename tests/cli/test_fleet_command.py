"""`roboglot fleet`: wrong settings end it in one sentence, and its answers name what was asked for."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sqlite3
from contextlib import nullcontext
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import pytest

from roboglot.cli import fleet
from roboglot.hosting.folder_lock import lock_folder
from roboglot.shards import nursery_client, serving
from roboglot.shards.folder_before import FolderBefore
from roboglot.shards.plan import load, plan_fleet, save
from roboglot.shards.requests import Answer, RobotRow, Row
from roboglot.shards.states import DETACHED, Shards, State
from roboglot.testing.addresses import free_addresses

if TYPE_CHECKING:
    from roboglot.shards.fleet_host import FleetHost

TEMPLATE = 'world = "moon"\n'


def before(folder: Path) -> FolderBefore:
    found = FolderBefore(folder)
    found.look()
    return found


def write(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("content")


async def zero() -> float:
    return 0.0


class Hopeless:
    """A fleet none of whose worlds can start."""

    def __init__(self, folder: Path) -> None:
        self.plan, self.folder, self.closed = plan_fleet(2, 1, {}, folder, first=free_addresses(2)), folder, False

    @cached_property
    def shards(self) -> Shards:
        return Shards(self.plan, self.folder)

    @cached_property
    def ended(self) -> asyncio.Future[None]:
        return asyncio.get_running_loop().create_future()

    async def start(self) -> float:
        self.folder.mkdir(exist_ok=True)
        save(self.plan, self.folder)
        for shard in self.shards.values():
            write(shard.folder / "log", self.folder / "nodes" / "1" / "shards" / shard.plan.name / "log")
            shard.hopeless, shard.reason = True, "no world is named 'moon'"
            self.shards.turn_to(shard, State.FAILED)
        return 0.0

    async def close(self) -> None:
        self.closed = True


class Unfinished(Hopeless):
    """A fleet that has begun to start when Ctrl-C comes, or its shards' machine is lost."""

    loss: OSError | None = None

    async def start(self) -> float:
        save(self.plan, self.folder)
        if self.loss is None:
            os.kill(os.getpid(), signal.SIGINT)
        else:
            self.ended.set_exception(self.loss)
        await asyncio.Event().wait()
        return 0.0


class Late(Unfinished):
    """A fleet whose addresses are another's at first."""

    async def start(self) -> float:
        for shard in self.shards.values():
            shard.reason = "127.0.0.1:1448 is in use"
            self.shards.turn_to(shard, State.FAILED)
        return 0.0


@pytest.mark.parametrize("lasting", [False, True])
async def test_a_fleet_is_ready_with_its_first_world(
    lasting: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    host, said = Late(tmp_path), list[str]()
    serving_it = asyncio.ensure_future(
        serving.serve(lambda: cast("FleetHost", host), before(tmp_path), said.append, 0.0, lasting=lasting)
    )
    async with asyncio.timeout(10.0):
        while "no world is up yet: 127.0.0.1:1448 is in use" not in caplog.text:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.001)
        assert said == []
        host.shards.turn_to(host.shards["w2"], State.READY)
        while not said:  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.001)
        host.ended.set_result(None)
        await serving_it
    assert said[0].startswith("1 of 2 worlds with 1 robot are up")
    assert said[1] == "ready"
    assert ["the worlds keep running" in line for line in said[2:]] == ([True] if lasting else [])


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("lasting", [False, True])
async def test_an_interrupted_start_keeps_no_new_plan(known: bool, lasting: bool, tmp_path: Path) -> None:
    host, old = Unfinished(tmp_path), plan_fleet(1, 1, {}, tmp_path)
    if known:
        save(old, tmp_path)
    with pytest.raises(serving.Interrupted, match="before all worlds were up"):
        await serving.serve(lambda: cast("FleetHost", host), before(tmp_path), print, 0.0, lasting=lasting)
    assert host.closed
    assert load(tmp_path) == (host.plan if lasting else old if known else None)


async def test_a_lost_cluster_ends_the_command(tmp_path: Path) -> None:
    host = Unfinished(tmp_path)
    host.loss = OSError("raylet has ended")
    with pytest.raises(OSError, match="raylet has ended"):
        await serving.serve(lambda: cast("FleetHost", host), before(tmp_path), print, 0.0, lasting=False)
    assert host.closed


@pytest.mark.parametrize("known", ["plan", "folder", "nothing"])
def test_fleet_without_a_world_leaves_nothing(known: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nursery_client, "launched", lambda **_: nullcontext(None))
    template, home = tmp_path / "class.toml", tmp_path / "home"
    folder = home / "f"
    host = Hopeless(folder)
    template.write_text(TEMPLATE)
    monkeypatch.setattr(fleet, "_fleet_host", lambda *_: host)
    if known != "nothing":
        write(folder / "shards" / "w1" / "data" / "programs", folder / "shards" / "w1" / "log", folder / "own")
    if known == "plan":
        save(host.plan, folder)
    files = sorted(home.rglob("*"))
    with pytest.raises(SystemExit, match=r"^roboglot fleet: no world can start: no world is named 'moon'$"):
        fleet.up(worlds=0 if known == "plan" else 2, template=None if known == "plan" else template, data=folder)
    assert host.closed
    assert sorted(home.rglob("*")) == files
    assert home.exists() is (known != "nothing")


def test_a_cluster_that_is_absent_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError("no Ray head answers there")

    monkeypatch.setattr(fleet, "_joined", refuse)
    with pytest.raises(SystemExit, match="no Ray head answers there"):
        fleet.up(worlds=2, first_address=free_addresses(2), on="ray://head", data=tmp_path / "f")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("was_up", [False, True])
async def test_an_interrupted_start_keeps_stored_data(was_up: bool, tmp_path: Path) -> None:
    host, folder = Unfinished(tmp_path / "f"), tmp_path / "f"
    folder.mkdir()
    found = before(folder)
    if was_up:
        host.shards.turn_to(host.shards["w2"], State.READY)
    with pytest.raises(serving.Interrupted):
        await serving.serve(lambda: cast("FleetHost", host), found, print, 0.0, lasting=False)
    write(folder / "shards" / "w2" / "data")
    found.clear()
    assert (folder / "shards").exists() is was_up


async def test_data_outlives_a_cluster_that_is_lost(tmp_path: Path) -> None:
    host = Late(tmp_path)
    found = before(tmp_path)
    for shard in host.shards.values():
        host.shards.turn_to(shard, State.READY)

    def lose(line: str) -> None:
        if line == "ready":
            host.ended.set_exception(OSError("raylet has ended"))

    host.start = zero  # type: ignore[method-assign]
    with pytest.raises(OSError, match="raylet has ended"):
        await serving.serve(lambda: cast("FleetHost", host), found, lose, 0.0, lasting=False)
    write(tmp_path / "shards" / "w1" / "data")
    found.clear()
    assert (tmp_path / "shards" / "w1" / "data").exists()


async def test_reasons_are_logged_once_some_world_is_up(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    host = Hopeless(tmp_path)
    await host.start()
    for shard in host.shards.values():
        host.shards.refused(shard)
    assert caplog.messages == [], "the command may end with the same words"
    host.shards.report_hopeless()
    host.shards.refused(host.shards["w2"])
    assert caplog.messages == ["shard w1 cannot start: no world is named 'moon'"]


@pytest.mark.parametrize(
    ("content", "reason"), [(None, "class.toml: No such file"), (b"a", "class.toml: "), (b"\xff", "class.toml: ")]
)
def test_unreadable_template_is_named(content: bytes | None, reason: str, tmp_path: Path) -> None:
    template = tmp_path / "class.toml"
    if content is not None:
        template.write_bytes(content)
    with pytest.raises(ValueError, match=reason) as refused:
        fleet._plan(tmp_path / "f", fleet._PlanOptions(1, 1, template, ""), replan=False)
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


@pytest.mark.parametrize(
    ("asked", "replan", "reason"),
    [
        (fleet._PlanOptions(None, 2, None, ""), False, "options of a plan need --worlds"),
        (fleet._PlanOptions(None, None, None, ""), True, "options of a plan need --worlds"),
        (fleet._PlanOptions(2, None, None, ""), False, "has another plan"),
    ],
)
def test_a_stored_plan_is_not_denied(asked: fleet._PlanOptions, replan: bool, reason: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"there is no fleet in .* yet: give --worlds"):
        fleet._plan(tmp_path, fleet._PlanOptions(None, 2, None, ""), replan=replan)
    save(plan_fleet(1, 1, {}, tmp_path), tmp_path)
    with pytest.raises(ValueError, match=reason):
        fleet._plan(tmp_path, asked, replan=replan)


def test_options_that_a_cluster_ignores_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="--memory-max is for shards without --on"):
        fleet.up(worlds=1, first_address=free_addresses(1), memory_max=9, on="local", data=tmp_path)


@pytest.mark.parametrize("worlds", [None, 1, 2])
def test_folder_in_use_is_named_first(worlds: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Joining a cluster takes up to a minute, and until then there is no plan, or an earlier one."""
    if worlds == 2:
        save(plan_fleet(1, 1, {}, tmp_path), tmp_path)
    monkeypatch.setattr(fleet, "_joined", lambda *_: pytest.fail("the cluster was joined"))
    lock = lock_folder(tmp_path)
    with pytest.raises(SystemExit, match=r"^roboglot fleet: another roboglot uses "):
        fleet.up(worlds=worlds, first_address=free_addresses(1), on="local", data=tmp_path)
    os.close(lock)


def test_a_plan_that_is_refused_makes_no_folder(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="yet: give --worlds"):
        fleet.up(data=tmp_path / "typo")
    assert list(tmp_path.iterdir()) == []


def test_detached_shards_are_named_without_a_fleet(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=f"^roboglot fleet: no fleet is up in {tmp_path}$"):
        fleet.show(data=tmp_path)
    (tmp_path / DETACHED).write_text("ray://head")
    with pytest.raises(SystemExit, match="may still run: `roboglot fleet up --on ray://head --detached` serves them"):
        fleet.show(data=tmp_path)


def test_looking_for_a_robot_makes_no_registry(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"^roboglot fleet: there is no file .*typo.db$"):
        fleet.where("a", registry=str(tmp_path / "typo.db"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"no database", "other"])
def test_file_of_another_program_stays_as_it_is(content: bytes | str, tmp_path: Path) -> None:
    file = tmp_path / "other.db"
    if isinstance(content, bytes):
        file.write_bytes(content)
    else:
        with contextlib.closing(sqlite3.connect(file)) as other:
            other.execute("CREATE TABLE own (value)")
    before = file.read_bytes()
    with pytest.raises(SystemExit, match=r"^roboglot fleet: .*other.db is not a registry of robots$"):
        fleet.where("a", registry=str(file))
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]


def test_a_missing_log_is_named(tmp_path: Path) -> None:
    save(plan_fleet(1, 1, {}, tmp_path), tmp_path)
    with pytest.raises(SystemExit, match=r"^roboglot fleet: shard w1 has no log yet$"):
        fleet.logs("a1", data=tmp_path)


@pytest.mark.parametrize(
    ("first", "then", "shown"),
    [((1, 500.0), (2, 3.0), "0.50"), ((1, 500.0), (1, 503.0), "0.50"), ((1, 0.0), (1, 20.0), "-")],
)
def test_processor_time_begins_at_zero_after_a_restart(
    first: tuple[int, float],
    then: tuple[int, float],
    shown: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Of a process (its id and s) without a heartbeat so far, it is unknown what its start took."""
    looks = [first, then]

    def look(*_: object) -> Answer:
        pid, cpu = looks.pop(0)
        return Answer([Row("w1", "ready", pid, [], 0.0, 1, 1.0, 0, cpu, "", "", "")], 1)

    times = iter((100.0, 106.0))
    monkeypatch.setattr(fleet, "_ask", look)
    monkeypatch.setattr(fleet, "time", SimpleNamespace(sleep=lambda _: None, monotonic=lambda: next(times)))
    fleet.top(once=True, period=6.0)
    assert capsys.readouterr().out.splitlines()[1].split()[4] == shown


async def test_only_robots_that_are_up_are_counted(tmp_path: Path) -> None:
    plan = plan_fleet(2, 3, {}, tmp_path)
    shards = Shards(plan, tmp_path)
    shards.turn_to(shards["w1"], State.READY)
    host = cast("FleetHost", SimpleNamespace(plan=plan, shards=shards))
    assert serving.up_text(host, 1.0, 0.0, "").startswith("1 of 2 worlds with 3 robots are up")
