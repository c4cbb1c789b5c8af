"""Campaigns: every trial ends in the table once, what dies is tried again, what is stopped goes on."""

from __future__ import annotations

import contextlib
import csv
import errno
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from unittest.mock import MagicMock

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st

from roboglot.cli import campaign
from roboglot.testing.campaign.report import interval, report
from roboglot.testing.campaign.table import OtherCampaign, Row, Table, write_parquet
from roboglot.testing.campaign.trials import Outcome, Result, Trial, named, trials_of
from roboglot.testing.scenarios.files import find
from roboglot.text_files import replacing
from tests.programs.playing import children_of

SLEEP = f"314.{os.getpid()}"
FINE = "given: {world: empty, body: robomaster_ep, lockstep: true}\nthen: [{travelled: {at_most: 1}}]\n"
STAYS = f"name: it stays\nwhen: [{{wait: 0.1}}]\n{FINE}"
KILL = 'kill -9 $(cut -d" " -f4 /proc/$PPID/stat)'  # the trial's process: its child runs commands
DIES = f"name: it dies\nwhen: [{{run: {KILL}}}]\n{FINE}"
LEAVES = f"setsid sleep {SLEEP} >/dev/null 2>&1 & env -i setsid sleep {SLEEP} >/dev/null 2>&1 &"
LEAVES_TWO = f"name: it leaves two\nwhen: [{{run: {LEAVES!r}}}]\n{FINE}"
DIES_AND_LEAVES = f"name: it dies\nwhen: [{{run: '{LEAVES} {KILL}'}}]\n{FINE}"
LOADS_FOR_EVER = "import sys, time\nif 'multiprocessing.forkserver' in str(sys.orig_argv):\n    time.sleep(3600)\n"
HANGS = f"name: it hangs\nwhen: [{{run: sleep {SLEEP}}}]\n{FINE}"


def still_sleeping() -> bool:
    """Return whether a hanging scenario's command is there."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if path.read_bytes().split(b"\0")[:2] == [b"sleep", SLEEP.encode()]:
                return True
    return False


def wait_until(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + 200
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def trial(seed: int, fingerprint: str = "f") -> Trial:
    return Trial("/nowhere", "a.yaml", "a", seed, fingerprint)


def begin(folder: Path, *options: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-u", "-m", "roboglot", "campaign", "scenarios", "--workers", "2", *options]
    pipe = subprocess.PIPE
    environment = os.environ | {"TMPDIR": str((folder / "tmp").readlink()), "PYTHONPATH": str(folder / "first")}
    return subprocess.Popen(
        command, cwd=folder, stdout=pipe, stderr=subprocess.STDOUT, text=True, start_new_session=True, env=environment
    )


def fork_server_of(process: subprocess.Popen[str]) -> bool:
    """Return whether the process from which it forks trials has begun to load."""
    for child in children_of(process.pid):
        with contextlib.suppress(OSError):
            if b"multiprocessing.forkserver" in Path(f"/proc/{child}/cmdline").read_bytes():
                return True
    return False


def rows(folder: Path) -> Sequence[dict[str, str]]:
    path = folder / "campaign/table.csv"
    return list(csv.DictReader(path.read_text().splitlines())) if path.exists() else []


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A folder with scenarios and temporary files, of which none may be left."""
    (tmp_path / "scenarios").mkdir()
    with tempfile.TemporaryDirectory(prefix="t-") as short:  # sockets lie in it, whose paths may have 107 bytes
        (tmp_path / "tmp").symlink_to(short)
        yield tmp_path
        assert list(Path(short).iterdir()) == []


def test_trials_are_all_tabulated_and_never_played_twice(folder: Path) -> None:
    """Hidden files are left out; a name that is no UTF-8 is written with escapes."""
    (folder / "scenarios" / os.fsdecode(b"st\xe9ys.yaml")).write_text(STAYS)
    (folder / "scenarios/dies.yaml").write_text(DIES)
    (folder / "scenarios/.venv").mkdir()
    for hidden in (".venv/settings.yaml", ".hidden.yml"):
        (folder / "scenarios" / hidden).write_text("no: scenario")
    first = begin(folder, "--seeds", "1")
    said, _ = first.communicate(timeout=200)
    assert first.returncode == 1, said
    assert "2 scenarios of" in said
    found = {row["scenario"]: row for row in rows(folder)}
    assert found.keys() == {"st\\xe9ys.yaml", "dies.yaml"}, said
    assert found["st\\xe9ys.yaml"]["outcome"] == "passed", said
    assert (found["dies.yaml"]["outcome"], found["dies.yaml"]["attempts"]) == ("crashed", "3")
    assert float(found["dies.yaml"]["seconds"]) > 0.0
    assert "1 of 2 trials passed" in (folder / "campaign/report.md").read_text()
    (folder / "scenarios/dies.yaml").unlink()
    again = begin(folder, "--seeds", "2")
    said, _ = again.communicate(timeout=200)
    assert "1 of 2 trials are in" in said
    assert again.returncode == 0, "the other scenario's crash is no trial of this command"
    assert "2 of 2 trials passed" in said
    assert "2 of 2 were played" in (folder / "campaign/report.md").read_text()
    assert [row["seed"] for row in rows(folder) if row["scenario"] == "st\\xe9ys.yaml"] == ["1", "2"]


def test_report_that_fills_the_disk_is_deleted(tmp_path: Path) -> None:
    page = tmp_path / "report.md"
    page.write_text("before")

    def write() -> None:
        with replacing(page) as fresh:
            fresh.write_text("half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(OSError, match="No space") as failed:
        write()
    assert failed.value.filename == str(page)
    assert [file.name for file in tmp_path.iterdir()] == ["report.md"]
    assert page.read_text() == "before"


NAMES = (
    *(b"plain.yaml", b"it's \xe9.yaml", b"a b.yaml", b"a`b.yaml", b"a\nb|c.yaml", b"a\\xe9.yaml", b"\\\xe9.yaml"),
    *("é\\.yaml".encode(), b"\\n\xe9f.yaml", b"\\\\x41\xff'.yaml"),
)


def test_labels_of_names_differ() -> None:
    labels = [Trial("/", os.fsdecode(name), "", 1, "").label for name in NAMES]
    assert [os.fsencode(named(label)) for label in labels] == list(NAMES)


def test_report_quotes_names_for_the_shell() -> None:
    broken = Row("s", "s", 1, Outcome.BROKEN, "why", 1.0, 1, "f")
    for name in NAMES:
        label = Trial("/", os.fsdecode(name), "", 1, "").label
        text = report([broken._replace(scenario=label)], Path("/x"), 1)
        line = text.partition("roboglot test ")[2].partition(" --seed")[0]
        shown = subprocess.run(["bash", "-c", f"printf %s {line}"], capture_output=True, check=True).stdout
        assert shown == b"/x/" + name


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_interrupted_campaign_leaves_a_table_and_no_process(number: signal.Signals, folder: Path) -> None:
    (folder / "scenarios/a_stays.yaml").write_text(STAYS)
    (folder / "scenarios/b_hangs.yaml").write_text(HANGS)
    process = begin(folder, "--seeds", "1")
    wait_until(lambda: rows(folder) and still_sleeping())
    process.send_signal(number)
    said, _ = process.communicate(timeout=180)
    assert process.returncode == 130, said
    assert "1 of 2 trials were played" in said
    assert (folder / "campaign/report.md").exists()
    assert not still_sleeping()


def test_ctrl_c_while_kernels_load_interrupts_in_words(folder: Path) -> None:
    """They load for ever here, as Python imports this file first."""
    (folder / "first").mkdir()
    (folder / "first/sitecustomize.py").write_text(LOADS_FOR_EVER)
    (folder / "scenarios/a_stays.yaml").write_text(STAYS)
    process = begin(folder, "--seeds", "1")
    wait_until(lambda: fork_server_of(process))
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    said, _ = process.communicate(timeout=180)
    assert process.returncode == 130, said
    assert "0 of 1 trials were played" in said
    assert "Traceback" not in said


@pytest.mark.slow  # in short: test_interrupted_campaign_leaves_a_table_and_no_process
def test_a_killed_campaign_leaves_no_process(folder: Path) -> None:
    (folder / "scenarios/b_hangs.yaml").write_text(HANGS)
    process = begin(folder, "--seeds", "1")
    wait_until(still_sleeping)
    process.kill()
    process.communicate(timeout=180)
    wait_until(lambda: not still_sleeping())
    wait_until(lambda: not list((folder / "tmp").iterdir()))


@pytest.mark.slow
def test_trials_do_not_import_the_main_program(folder: Path) -> None:
    """That of a worker of Ray takes seconds."""
    (folder / "a.yaml").write_text(STAYS)
    program = folder / "program.py"
    program.write_text(
        "from pathlib import Path\n"
        "from roboglot.testing.campaign.local import play_here\n"
        "from roboglot.testing.campaign.trials import trials_of\n"
        "from roboglot.testing.scenarios.files import find\n"
        f"trials = trials_of(find([Path({str(folder / 'a.yaml')!r})]), Path({str(folder)!r}), range(1))\n"
        "play_here(trials, 1, 600.0, lambda _: None, lambda _, result: print(result.outcome, result.attempts))\n"
    )
    done = subprocess.run([sys.executable, program], capture_output=True, text=True, check=False, timeout=180)
    assert done.stdout == "passed 1\n", done.stderr


@pytest.mark.slow  # in short: tests/testing/test_scenarios.py::test_leftovers_of_a_command_end_with_its_scenario
def test_leftovers_of_scenarios_end_with_them(folder: Path) -> None:
    (folder / "scenarios/leaves.yaml").write_text(LEAVES_TWO)
    (folder / "scenarios/dies.yaml").write_text(DIES_AND_LEAVES)
    process = begin(folder, "--seeds", "1")
    said, _ = process.communicate(timeout=180)
    assert {row["outcome"] for row in rows(folder)} == {"passed", "crashed"}, said
    wait_until(lambda: not still_sleeping())  # what ends those of a killed trial ends later than the campaign


@given(st.lists(st.integers(0, 50), unique=True), st.binary(max_size=30).filter(lambda tail: b"\n" not in tail))
def test_rows_survive_what_a_kill_leaves_behind(
    tmp_path_factory: pytest.TempPathFactory, seeds: list[int], tail: bytes
) -> None:
    path = tmp_path_factory.mktemp("table") / "table.csv"
    table = Table(path)
    for seed in seeds:
        table.add(trial(seed), Result(Outcome.FAILED, 'why, "so" and\nmore', 1.5))
    table.close()
    with path.open("ab") as file:
        file.write(tail)
    table = Table(path)
    assert [row.seed for row in table.rows] == seeds
    assert all(table.done(trial(seed)) for seed in seeds)
    table.add(trial(99), Result(Outcome.CRASHED))
    assert not table.done(trial(99))  # it is retried
    table.close()


def test_a_full_disk_loses_no_trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "table.csv"
    table = Table(path)
    table.add(trial(1), Result(Outcome.PASSED))

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left on device") as failed:
        table.add(trial(2), Result(Outcome.PASSED))
    assert failed.value.filename == str(path)
    table.close()
    monkeypatch.undo()
    table = Table(path)
    assert table.done(trial(1))
    table.close()


def test_another_program_is_another_scenario(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("name: a\nwhen: [{program: b.py}]\nthen: [{refused: 0}]\n")
    (tmp_path / "b.py").write_text("pass\n")
    (before,) = trials_of(find([tmp_path]), tmp_path, range(1))
    (tmp_path / "b.py").write_text("1 / 0\n")
    (after,) = trials_of(find([tmp_path]), tmp_path, range(1))
    assert before.fingerprint != after.fingerprint


def test_a_trial_played_again_leaves_one_row(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    for outcome in (Outcome.CRASHED, Outcome.CRASHED, Outcome.PASSED):
        table = Table(path)
        assert not table.done(trial(1))
        table.add(trial(1), Result(outcome))
        table.add(trial(2), Result(Outcome.CRASHED))
        table.close()
        assert [row["outcome"] for row in csv.DictReader(path.read_text().splitlines())] == [outcome, "crashed"]
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]
    table = Table(path)
    assert table.done(trial(1))
    table.close()


def test_other_tables_and_other_scenarios_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("a,b\n1,2")  # its last line is incomplete
    with pytest.raises(OtherCampaign, match="not a table of a campaign"):
        Table(path)
    assert path.read_text() == "a,b\n1,2"
    path.unlink()
    table = Table(path)
    table.add(trial(1), Result(Outcome.PASSED))
    with pytest.raises(OtherCampaign, match="another version"):
        table.done(trial(1, "g"))
    with pytest.raises(OtherCampaign, match="another campaign"):
        Table(path)
    table.close()


@given(st.integers(1, 10_000), st.integers(0, 10_000))
def test_the_interval_holds_the_share(count: int, passed: int) -> None:
    passed = min(passed, count)
    low, high = interval(passed, count)
    assert 0 <= low <= passed / count <= high <= 1


def test_the_report_groups_reasons_that_differ_in_numbers(tmp_path: Path) -> None:
    failed = [Row("a.yaml", "a", n, Outcome.FAILED, f"then 1: moved 0.{n} m", 1.0, 1, "f") for n in range(3)]
    page = report([*failed, Row("a.yaml", "a", 9, Outcome.PASSED, "", 2.0, 1, "f")], tmp_path, 4)
    assert "3 x failed: then 1: moved 0.0 m (seeds 0, 1, 2)" in page
    assert f"roboglot test {tmp_path / 'a.yaml'} --seed 0" in page


def test_reported_command_is_quoted_for_a_shell(tmp_path: Path) -> None:
    page = report([Row("a b.yaml", "a", 0, Outcome.FAILED, "moved", 1.0, 1, "f")], tmp_path, 1)
    assert f"roboglot test '{tmp_path / 'a b.yaml'}' --seed 0" in page


ENDED = Row("a.yaml", "a", 1, Outcome.PASSED, "", 1.5, 1, "f")


@pytest.mark.parametrize("ended", [[], [ENDED], [ENDED, ENDED._replace(outcome=Outcome.FAILED, why="moved")]])
def test_parquet_has_the_same_types_for_any_rows(tmp_path: Path, ended: list[Row]) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the package pyarrow is not installed")
    path = tmp_path / "table.parquet"
    assert write_parquet(ended, path)
    found = parquet.read_table(path)
    text = "string"
    assert [str(kind) for kind in found.schema.types] == [text, text, "int64", text, text, "double", "int64", text]
    assert found.to_pylist() == [{**row._asdict(), "why": row.why or None} for row in ended]
    assert list(tmp_path.iterdir()) == [path]


def write_half(_table: object, path: Path) -> None:
    path.write_text("PAR1")
    raise OSError(errno.ENOSPC, "No space left on device")


def test_failed_writing_keeps_the_earlier_parquet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pyarrow, parquet = MagicMock(__spec__=ModuleSpec("pyarrow", None)), MagicMock(write_table=write_half)
    monkeypatch.setitem(sys.modules, "pyarrow", pyarrow)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", parquet)
    path = tmp_path / "table.parquet"
    path.write_text("whole")
    with pytest.raises(OSError, match="No space"):
        write_parquet([ENDED], path)
    assert path.read_text() == "whole"


def test_without_pyarrow_no_outdated_parquet_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.testing.campaign.table.find_spec", lambda _: None)
    path = tmp_path / "table.parquet"
    path.write_text("of an earlier run")
    assert not write_parquet([ENDED], path)
    assert not path.exists()


def test_campaign_that_ends_early_reports_what_was_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "stays.yaml").write_text(STAYS)

    def play(trials: Iterator[Trial], _leave: object, ended: Callable[[Trial, Result], None]) -> None:
        ended(next(trials), Result(Outcome.PASSED))
        raise OSError("raylet, a process of Ray, has ended")

    monkeypatch.setattr(campaign, "_player", lambda *_: play)
    with pytest.raises(typer.Exit) as exited:
        campaign.command([tmp_path / "stays.yaml"], seeds=2, first_seed=1, on="", out=tmp_path / "out", longest=60.0)
    assert exited.value.exit_code == 2
    said = capsys.readouterr()
    assert "1 of 1 trials passed" in said.out
    assert said.err.splitlines() == [
        "roboglot campaign: raylet, a process of Ray, has ended",
        "the same command resumes",
    ]
    assert "1 of 2 were played" in (tmp_path / "out" / "report.md").read_text()
