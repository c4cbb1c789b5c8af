"""Commands name a file that is not there, or not what it should be, in plain words."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from roboglot.cli import connect, mcp
from roboglot.cli.fleet import _plan, _PlanOptions
from roboglot.cli.programs import lesson
from roboglot.clients.cyberdog.link import Certificates
from roboglot.config import load_config
from roboglot.datasets.formats import read_drive_log
from roboglot.datasets.measures import read_relations
from roboglot.hosting.error_text import in_words
from roboglot.hosting.folder_lock import lock_folder
from roboglot.recording.comparing.masks import read_mask
from roboglot.recording.reader import records
from roboglot.simulation.world.declarations import read_toml
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.world_files import import_ros_map
from roboglot.testing.scenarios import files
from roboglot.transport.tls import server_context


@pytest.mark.parametrize(
    "words",
    [
        ("record", "info", "no.mcap"),
        ("record", "repair", "no.mcap", "new.mcap"),
        ("replay", "no.mcap", "--against", "slamware://127.0.0.1"),
        ("compare", "no.mcap", "other.mcap"),
        ("rerun", "no.mcap"),
        ("program", "run", "no.mcap"),
        ("up", "--config", "no.mcap"),
        ("test", "no.mcap"),
        ("map", "build", "no.mcap", "--out", "new.yaml"),
    ],
)
def test_missing_file_is_named(words: tuple[str, ...], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "roboglot", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert done.returncode
    assert done.stderr.strip() == f"roboglot {words[0]}: no.mcap: No such file or directory"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("record", "info", ""), "record: .: Is a directory"),
        (("certs", "--data", "note.txt", "--export", "new"), "certs: note.txt/cyberdog: Not a directory"),
        (("access", "add", "app", "--data", "data", "--cyberdog", "note.txt"), "access: note.txt: File exists"),
    ],
)
def test_file_instead_of_folder_is_named(words: tuple[str, ...], said: str, tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("mine")
    command = [sys.executable, "-m", "roboglot", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=180, check=False)
    assert (done.returncode, done.stderr.strip()) == (1, f"roboglot {said}")
    assert (tmp_path / "note.txt").read_text() == "mine"


def template(path: Path) -> object:
    return _plan(path.parent, _PlanOptions(1, 1, path, ""), replan=True)


TOML: list[Callable[[Path], object]] = [
    lambda path: load_config(path, {}),
    lambda path: read_toml(path, WorldDescription),
    read_mask,
    template,
]


@pytest.mark.parametrize("read", [*TOML, files.read, import_ros_map])
def test_file_that_is_no_text_is_named(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "map.bin"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=rf"^{re.escape(str(path))}: not UTF-8 text \(invalid start byte\)$"):
        read(path)


@pytest.mark.parametrize("read", [*TOML, files.read, lesson._text])
def test_file_that_is_too_long_is_named(read: Callable[[Path], object], tmp_path: Path) -> None:
    """Only its beginning is read."""
    path = tmp_path / "log.bin"
    path.touch()
    os.truncate(path, 32 << 20)
    with pytest.raises(ValueError, match=rf"^{re.escape(str(path))}: longer than \d+ characters$"):
        read(path)


@pytest.mark.parametrize("read", TOML)
def test_file_that_is_no_toml_is_named(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "settings.txt"
    path.write_text("world = \n")
    with pytest.raises(ValueError, match=rf"^{re.escape(str(path))}: not TOML: Invalid value \(at line 1, column 9\)$"):
        read(path)


def test_token_file_that_is_no_text_is_named(tmp_path: Path) -> None:
    path = tmp_path / "token"
    path.write_bytes(b"\xff")
    with pytest.raises(SystemExit, match=rf"^roboglot connect: {re.escape(str(path))}: not UTF-8 text"):
        connect.command("127.0.0.1", token_file=path)
    with pytest.raises(typer.BadParameter, match=rf"^{re.escape(str(path))}: not UTF-8 text"):
        mcp.command(token_file=path)


def recording(path: Path) -> object:
    return list(records(path))


def tls(path: Path) -> object:
    return server_context(path, path)


def phone(path: Path) -> object:
    for name in ("ca-cert", "client-cert", "client-key"):
        path.with_name(f"{name}.pem").symlink_to(path)
    return Certificates.load(path.parent)


READERS = [*TOML, files.read, lesson._text, import_ros_map, read_drive_log, read_relations, recording, tls, phone]


@pytest.mark.parametrize("read", READERS)
def test_named_pipe_is_refused(read: Callable[[Path], object], tmp_path: Path) -> None:
    """Opening it would wait for a program that writes, for ever."""
    os.mkfifo(path := tmp_path / "pipe.yaml")
    with pytest.raises((ValueError, OSError)) as refused:
        read(path)
    assert re.search(r"/(pipe.yaml|ca-cert.pem): not a regular file$", in_words(refused.value))


def test_pipe_of_the_shell_is_read(tmp_path: Path) -> None:
    """As in ``--config <(command)``."""
    reading, writing = os.pipe()
    os.write(writing, b"seed = 7\n")
    os.close(writing)
    assert load_config(Path(f"/dev/fd/{reading}"), {}).seed == 7
    os.close(reading)


@pytest.mark.parametrize("name", ["file", "file/folder"])
def test_data_folder_that_is_a_file_is_named(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError) as refused:
        lock_folder(tmp_path / name)
    assert in_words(refused.value) == f"{tmp_path / name}: Not a directory; choose another folder with --data"
