"""``roboglot access`` and ``roboglot audit`` as people call them."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from roboglot.access.rights import effective, parse_rights, write_rights
from roboglot.access.secrets import password_fits, password_hash, token_hash
from roboglot.access.store import FILE, Grant, IdentityKind, open_store
from roboglot.access.trail import Entry, open_trail
from roboglot.cli.access import _end, _moment
from roboglot.operations import Right


def call(*arguments: str, text: str = "") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "roboglot", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=180, check=False, input=text)


def test_a_machine_is_let_in_and_revoked(tmp_path: Path) -> None:
    added = call("access", "add", "cell", "--rights", "drive,edit", "--robots", "a,b", "--data", str(tmp_path))
    store = open_store(tmp_path)
    [cell] = store.identities()
    assert cell.token == token_hash(added.stdout.strip())
    assert [grant.robot for grant in cell.grants] == ["a", "b"]
    assert "cell" in call("access", "list", "--data", str(tmp_path)).stdout
    assert call("access", "revoke", "cell", "--data", str(tmp_path)).returncode == 0
    assert store.identities() == []
    again = call("access", "revoke", "cell", "--data", str(tmp_path))
    assert (again.returncode, again.stderr.count("\n")) == (1, 1)
    store.close()


def test_people_apps_and_addresses(tmp_path: Path) -> None:
    data = ("--data", str(tmp_path))
    assert call("access", "add", "anna", "--person", *data, text="correct horse\n").returncode == 0
    app = call("access", "add", "phone", "--cyberdog", str(tmp_path / "phone"), *data)
    assert "client-key.pem" in app.stdout
    assert call("access", "allow", "10.0.0.7", "a", "--for", "2h", *data).returncode == 0
    store = open_store(tmp_path)
    found = {identity.name: identity for identity in store.identities()}
    store.close()
    assert {name: identity.kind for name, identity in found.items()} == {
        "anna": IdentityKind.PERSON,
        "phone": IdentityKind.APP,
        "10.0.0.7": IdentityKind.ADDRESS,
    }
    assert password_fits("correct horse", found["anna"].password)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("access", "add", "x", "--rights", "fly"), "rights are see, drive"),
        (("access", "add", "a b"), "no blanks"),
        (("access", "allow", "nowhere", "a"), "address"),
        (("access", "add", "x", "--for", "soon"), "2h"),
        (("audit",), "there is none"),
    ],
)
def test_mistakes_are_reported_in_one_line(tmp_path: Path, arguments: tuple[str, ...], words: str) -> None:
    ended = call(*arguments, "--data", str(tmp_path))
    assert ended.returncode == 1
    assert words in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_audit_is_printed_and_verified(tmp_path: Path) -> None:
    known = Entry(time.time(), "anna", "10.0.0.7:1", "a", "slamware", "DELETE /x", "done")
    unknown = Entry(time.time(), "", "10.0.0.8:1", "a", "", "", "turned away", "why")
    with open_trail(tmp_path) as trail:
        trail.add([known, unknown])
    printed = call("audit", "--data", str(tmp_path)).stdout
    assert "a slamware anna 10.0.0.7:1 DELETE /x done\n" in printed
    assert "a - - 10.0.0.8:1 - turned away: why\n" in printed  # a column of its own for each field
    assert "2 rows are intact" in call("audit", "--verify", "--data", str(tmp_path)).stdout


def test_rights_are_read_and_written() -> None:
    assert write_rights(parse_rights("edit, drive")) == "drive,edit"
    assert effective([Right.PROGRAM]) == {Right.SEE, Right.DRIVE, Right.PROGRAM}
    assert effective([Right.ADMIN]) == set(Right)
    assert effective([]) == frozenset()


def test_times_of_people_are_understood() -> None:
    now = time.time()
    assert _end("", "2h") == pytest.approx(now + 7200, abs=60)
    assert _end("", "") is None
    assert now < (_end("00:00", "") or 0) <= now + 86400 + 3600
    for wrong in (("25:00", ""), ("", "2 weeks"), ("18:00", "2h")):
        with pytest.raises(ValueError, match="--"):
            _end(*wrong)


@pytest.fixture
def local_zone(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The time zone of this machine: the fixture's parameter."""
    with monkeypatch.context() as patch:
        patch.setenv("TZ", request.param)
        time.tzset()
        yield
    time.tzset()


@pytest.mark.parametrize("local_zone", ["America/New_York", "Asia/Shanghai"], indirect=True)
@pytest.mark.parametrize(
    ("until", "lasts"),
    [("2020-01-31T18:00", ""), ("1900-01-01", ""), ("0001-01-01", ""), ("", "0s"), ("9999-12-31T23:59:59-12:00", "")],
)
@pytest.mark.usefixtures("local_zone")
def test_ends_past_or_beyond_calendars_are_refused(until: str, lasts: str) -> None:
    with pytest.raises(ValueError, match=r"not in the future|beyond the year 9999|--until is"):
        _end(until, lasts)


@pytest.mark.parametrize("local_zone", ["Europe/Berlin"], indirect=True)
@pytest.mark.usefixtures("local_zone")
def test_clock_times_follow_changes_of_clocks() -> None:
    evening = datetime.fromisoformat("2026-03-28T20:00").astimezone()  # the night in which summer time begins
    assert _moment("11:00", evening) == datetime(2026, 3, 29, 9, tzinfo=UTC)
    assert _moment("21:00", evening) == datetime(2026, 3, 28, 20, tzinfo=UTC)


def test_passwords_are_kept_as_scrypt() -> None:
    kept = password_hash("correct horse")
    assert kept.startswith("scrypt$")
    assert password_hash("correct horse") != kept
    assert not password_fits("wrong horse", kept)
    assert not password_fits("", "")
    with pytest.raises(ValueError, match="8 to"):
        password_hash("short")


def test_the_file_is_its_owners_alone(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    store.add_machine("cell", [Grant("a", frozenset({Right.SEE}))])
    store.close()
    assert (tmp_path / FILE).stat().st_mode & 0o077 == 0
