"""Plans of fleets, the nursery's one thread, and the rows of a robot that moves."""

from __future__ import annotations

import errno
import math
import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.shards import warm_up
from roboglot.shards.plan import FIRST_ADDRESS, PLAN, EarlierPlan, load, plan_fleet, save
from roboglot.shards.warm_up import ENVIRONMENT
from roboglot.storage.database import connect
from roboglot.storage.transfer import copy_robot, forget_robot

BODIES = "b.toml+hard", "hermes+hard", "recording:r.mcap", "slamware://10.0.0.1"


@given(st.integers(1, 40), st.integers(1, 30))
def test_names_and_addresses_are_each_robots_own(worlds: int, each: int) -> None:
    plan = plan_fleet(worlds, each, {}, Path("/nowhere"))
    robots = [robot for shard in plan.shards for robot in shard.settings["robots"]]
    assert len(robots) == worlds * each
    assert len({robot["name"] for robot in robots}) == len({robot["address"] for robot in robots}) == len(robots)
    assert len({shard.settings["data"] for shard in plan.shards}) == worlds


def test_shards_are_found_by_their_robots() -> None:
    plan = plan_fleet(2, 2, {}, Path("/nowhere"))
    assert plan.find("w2") is plan.find("b2") is plan.shard("w2")
    with pytest.raises(LookupError, match=r"no robot 'c1'; there are w1, w2$"):
        plan.find("c1")


@pytest.mark.parametrize(
    ("worlds", "each", "template", "first", "reason"),
    [
        (0, 1, {}, FIRST_ADDRESS, "worlds"),
        (1, 101, {}, FIRST_ADDRESS, "robots in each world"),
        (1, 0, {"robots": [{"name": "a", "address": "127.0.0.9"}]}, FIRST_ADDRESS, "must not have addresses"),
        (
            2,
            0,
            {"robots": [{"name": "a", "serial": "SN1"}]},
            FIRST_ADDRESS,
            "must not have .* serial numbers",
        ),
        (1, 1, {"robots": [{"name": "a"}, {"name": "b"}]}, FIRST_ADDRESS, "--robots-each is 1"),
        (1, 1, {"planet": "moon"}, FIRST_ADDRESS, "the template: planet is not a setting"),
        (1, 1, {"robots": 5}, FIRST_ADDRESS, "the template: robots"),
        (1, 1, {"robots": ["a"]}, FIRST_ADDRESS, "the template: robots"),
        (1, 1, {"robots": [{"name": 3}]}, FIRST_ADDRESS, "the template: robots"),
        (1, 1, {"seed": "x"}, FIRST_ADDRESS, "the template: seed"),
        (1, 1, {"console": 3}, FIRST_ADDRESS, "the template: console"),
        (1, 1, {"console": {"address": "127.0.0.1", "port": "x"}}, FIRST_ADDRESS, "the template: console"),
        (1, 1, {"access": 1}, FIRST_ADDRESS, "the template: access"),
        (1, 1, {"access": {"gateway": "0.0.0.0"}}, FIRST_ADDRESS, "access.gateway must be HOST:PORT, not '0.0.0.0'"),
        (
            2,
            1,
            {"access": {"gateway": "0.0.0.0:65535"}},
            FIRST_ADDRESS,
            "^access.gateway of world w2 would be 65536: w",
        ),
        (
            8,
            1,
            {"console": {"address": "127.0.0.1", "port": 65530}},
            FIRST_ADDRESS,
            "^console.port of world w7 would be 65536: worlds take the ports from 65530 on$",
        ),
        (1, 1, {}, "10.0.0.1", "others could reach"),
        (1, 1, {}, "somewhere", "first address"),
        (2, 1, {}, "255.255.255.254", "no 2 addresses"),
        (1, 1, {"data": 5}, FIRST_ADDRESS, "^the template: data must be text, not a whole number$"),
        (1, 1, {"speed": math.nan}, FIRST_ADDRESS, "^the template: speed must be above 0, not nan$"),
        (1, 1, {"speed": -1.0}, FIRST_ADDRESS, "^the template: speed must be above 0, not -1$"),
        (1, 1, {"data": "/var/robots"}, FIRST_ADDRESS, "must not have `data`"),
        (1, 1, {"lockstep": True}, FIRST_ADDRESS, "no standard input"),
        (2, 0, {"robots": [{"body": "slamware://10.0.0.1"}]}, FIRST_ADDRESS, "share the real robot slamware://10"),
        (2, 1, {"record": {"to": "lesson.mcap"}}, FIRST_ADDRESS, "share the recording .*lesson.mcap: `to` must be a"),
    ],
)
def test_plans_that_cannot_be_are_refused(
    worlds: int, each: int, template: dict[str, object], first: str, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        plan_fleet(worlds, each, template, Path("/nowhere"), first=first)


def test_files_of_a_template_are_found_from_everywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    template = {
        "world": "w.toml",
        "registry": "homes.db",
        "access": {"tls": {"certificate": "c.pem", "key": "/etc/k.pem"}},
        "robots": [{"name": name, "body": body} for name, body in zip("abcd", BODIES, strict=True)],
    }
    plan = plan_fleet(1, 0, template, tmp_path)
    assert plan.request["template"] == template
    settings = plan.shards[0].settings
    assert (settings["world"], settings["registry"]) == (f"{tmp_path}/w.toml", f"{tmp_path}/homes.db")
    assert settings["access"]["tls"] == {"certificate": f"{tmp_path}/c.pem", "key": "/etc/k.pem"}
    there = [f"{tmp_path}/b.toml+hard", "hermes+hard", f"recording:{tmp_path}/r.mcap", "slamware://10.0.0.1"]
    assert [robot["body"] for robot in settings["robots"]] == there
    server = plan_fleet(1, 1, {"world": "yard", "registry": "postgresql://host/name"}, tmp_path).shards[0].settings
    assert (server["world"], server["registry"]) == ("yard", "postgresql://host/name")


def test_each_world_records_to_its_own_folder() -> None:
    plan = plan_fleet(2, 1, {"record": {"to": "/rec", "ring": True}}, Path("/nowhere"))
    assert [shard.settings["record"] for shard in plan.shards] == [
        {"to": "/rec/w1/", "ring": True},
        {"to": "/rec/w2/", "ring": True},
    ]


@pytest.mark.parametrize(
    ("given", "wanted"),
    [("0.0.0.0:9443", ["0.0.0.0:9443", "0.0.0.0:9444"]), ("[::1]:0", ["[::1]:0", "[::1]:0"])],
)
def test_each_world_has_its_own_gateway(given: str, wanted: list[str]) -> None:
    plan = plan_fleet(2, 1, {"access": {"gateway": given}}, Path("/nowhere"))
    assert [shard.settings["access"]["gateway"] for shard in plan.shards] == wanted


def test_a_stored_plan_needs_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_fleet(1, 1, {}, tmp_path)
    save(plan, tmp_path)

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    save(plan, tmp_path)
    with pytest.raises(OSError, match="No space left on device") as failed:
        save(plan_fleet(2, 1, {}, tmp_path), tmp_path)
    assert failed.value.filename == str(tmp_path / PLAN)
    assert [path.name for path in tmp_path.iterdir()] == [PLAN]
    assert load(tmp_path) == plan


@pytest.mark.parametrize("before", [True, False])
def test_a_failed_plan_gives_way_to_the_last(tmp_path: Path, before: bool) -> None:
    old = plan_fleet(1, 1, {}, tmp_path) if before else None
    if old:
        save(old, tmp_path)
    earlier = EarlierPlan(tmp_path)
    assert not earlier.restore(), "it is there"
    save(plan_fleet(2, 1, {"world": "moon"}, tmp_path), tmp_path)
    assert earlier.restore()
    assert load(tmp_path) == old


def test_a_plan_is_kept(tmp_path: Path) -> None:
    assert load(tmp_path) is None
    plan = plan_fleet(2, 1, {}, tmp_path)
    save(plan, tmp_path)
    assert load(tmp_path) == plan
    (tmp_path / "fleet.json").write_text("{")
    with pytest.raises(ValueError, match="cannot be read"):
        load(tmp_path)


def test_plan_below_a_file_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match=f"^{tmp_path}/file/fleet.json: Not a directory$"):
        load(tmp_path / "file")


@pytest.mark.slow  # a start of its own: the nursery of test_fleet_served warms itself, too
def test_warming_starts_no_thread() -> None:
    """Raises Threaded otherwise; a fork would copy the thread's locks without the thread."""
    code = "from roboglot.shards.warm_up import warm; warm()"
    subprocess.run([sys.executable, "-c", code], env={**ENVIRONMENT}, check=True, timeout=120)


def test_rows_of_one_robot_go_and_others_stay(tmp_path: Path) -> None:
    old, new = tmp_path / "old.db", tmp_path / "new.db"
    with closing(connect(old)) as connection:
        for robot in ("a", "b"):
            connection.execute("INSERT INTO setting VALUES (?, 'volume', '7')", (robot,))
            connection.execute(
                "INSERT INTO place (robot, id, x, y, yaw, metadata) VALUES (?, 'desk', 1, 2, 3, '{}')", (robot,)
            )
    with closing(connect(new)) as connection:
        connection.execute("INSERT INTO setting VALUES ('b', 'volume', '1')")
        connection.execute("INSERT INTO setting VALUES ('c', 'volume', '2')")
    for _ in range(2):  # an interrupted move is repeated
        assert copy_robot("b", old, new) == 2
    forget_robot("b", old)
    with closing(connect(old)) as connection:
        assert connection.execute("SELECT robot FROM place").fetchall() == [("a",)]
    with closing(connect(new)) as connection:
        assert connection.execute("SELECT robot, value FROM setting ORDER BY robot").fetchall() == [
            ("b", "7"),
            ("c", "2"),
        ]
        assert connection.execute("SELECT robot FROM place").fetchall() == [("b",)]
    assert copy_robot("b", tmp_path / "none.db", new) == 0


def test_kernels_are_compiled_in_a_process_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []
    monkeypatch.setattr(warm_up.subprocess, "run", lambda command, **_: started.append(command))
    monkeypatch.setattr("roboglot.kernels.ahead.missing", lambda: ["search"])
    warm_up._compile()
    assert [command[1:] for command in started] == [["-m", "roboglot.kernels"]]
