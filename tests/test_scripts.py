"""The scripts' pure parts: what they decide, without a network and without making an environment."""

import errno
import hashlib
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path
from types import SimpleNamespace
from typing import BinaryIO
from unittest.mock import Mock
from urllib.parse import unquote, urlsplit

import bootstrap
import locks
import pytest
import setuptools_scm
from _claim import Claims

ROOT = Path(__file__).resolve().parent.parent
NOBODY = 65534
WHEEL = b"not really a wheel"
NAME = "pip-26.3-py3-none-any.whl"
LOCK = f"pip==26.3 --hash=sha256:{hashlib.sha256(WHEEL).hexdigest()}\n"


# --- the stamp


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A project as the scripts see it, in a folder with a space in its name."""
    root = tmp_path / "my clone"
    for folder in ("scripts", "requirements", ".venv/bin", "src/roboglot/kernels"):
        (root / folder).mkdir(parents=True)
    (root / "scripts/environment").write_bytes((ROOT / "scripts/environment").read_bytes())
    (root / "requirements/run.lock").write_text("numpy==2.4.6\n")
    (root / "pyproject.toml").write_text("[project]\n")
    (root / ".venv/bin/python").symlink_to("/bin/sh")
    (root / ".venv/kernels").touch()
    return root


def environment(root: Path, user: int | None = None, **variables: str) -> subprocess.CompletedProcess[str]:
    """Runs `environment run` of the clone's scripts/environment."""
    line = 'source "$1/scripts/environment"; environment run; echo went on'
    return subprocess.run(
        ["env", "--default-signal=INT", "bash", "-c", line, "bash", str(root)],
        env={"PATH": os.environ["PATH"], **variables},
        user=user,
        capture_output=True,
        text=True,
        timeout=180,
    )


def test_bash_and_python_write_the_same_stamp(clone: Path) -> None:
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    done = environment(clone, PYTHON="/bin/false")
    assert (done.returncode, done.stdout, done.stderr) == (0, "went on\n", "")


def test_kernels_are_recompiled_when_their_source_is_newer(clone: Path) -> None:
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    os.utime(clone / ".venv/kernels", (1, 1))
    (clone / "src/roboglot/kernels/search.py").write_text("# newer\n")
    done = environment(clone)
    assert done.stdout == "went on\n"
    assert "compiling the numeric kernels" in done.stderr


@pytest.mark.parametrize("called", ["./scripts/run", "bash run", "sh scripts/run", "../robot", "bash ../robot"])
def test_start_works_however_it_is_called(clone: Path, called: str) -> None:
    (clone / "scripts/run").write_bytes((ROOT / "scripts/run").read_bytes())
    (clone / "scripts/run").chmod(0o755)
    (clone.parent / "robot").symlink_to(clone / "scripts/run")
    (clone / ".venv/bin/roboglot").write_text('#!/bin/sh\necho "$@"\n')
    (clone / ".venv/bin/roboglot").chmod(0o755)
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    folder = clone / "scripts" if called == "bash run" else clone
    command = [*called.split(), "--world", "my yard"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=180)
    assert (done.returncode, done.stdout, done.stderr) == (0, "up --world my yard\n", "")


def test_every_script_finds_the_others_through_a_link() -> None:
    texts = [path.read_text("utf-8") for path in (ROOT / "scripts").iterdir() if path.is_file()]
    assert not [text for text in texts if '"${BASH_SOURCE[0]%/*}/environment"' in text]


@pytest.mark.parametrize("status", [130, 1])
def test_ctrl_c_while_kernels_compile_starts_no_robot(clone: Path, status: int) -> None:
    (clone / ".venv/bin/python").unlink()
    (clone / ".venv/bin/python").write_text(f"#!/bin/sh\nkill -INT $PPID\nexit {status}\n")
    (clone / ".venv/bin/python").chmod(0o755)
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    (clone / ".venv/kernels").unlink()
    done = environment(clone)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.endswith("interrupted; the next start compiles the rest\n")
    assert not (clone / ".venv/kernels").exists()


def test_users_of_anothers_clone_leave_its_kernels_alone(clone: Path) -> None:
    """They could not note that they have compiled them, and that failure ended the start."""
    with tempfile.TemporaryDirectory() as shared:
        root = Path(shutil.copytree(clone, Path(shared) / "clone", symlinks=True))
        (root / ".venv/stamp-run").write_bytes(bootstrap.stamp(root, "run"))
        (root / ".venv/kernels").unlink()
        root.parent.chmod(0o755)
        (root / ".venv").chmod(0o555)
        done = environment(root, user=NOBODY if os.geteuid() == 0 else None)
        (root / ".venv").chmod(0o755)
    assert (done.returncode, done.stdout, done.stderr) == (0, "went on\n", "")


@pytest.mark.parametrize("changed", ["requirements/run.lock", "pyproject.toml"])
def test_changed_file_asks_for_a_new_set_up(clone: Path, changed: str) -> None:
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    with (clone / changed).open("a") as file:
        file.write("# more\n")
    done = environment(clone, PYTHON="/bin/false")
    assert done.returncode == 1
    assert "needs Python 3.11 to 3.14; tried /bin/false" in done.stderr


def test_missing_python_asks_for_a_new_set_up(clone: Path) -> None:
    (clone / ".venv/bin/python").unlink()
    (clone / ".venv/bin/python").symlink_to(clone / "gone")
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    assert environment(clone, PYTHON="/bin/false").returncode == 1


def test_a_moved_clone_has_another_stamp(clone: Path) -> None:
    before = bootstrap.stamp(clone, "run")
    moved = clone.rename(clone.parent / "elsewhere")
    assert bootstrap.stamp(moved, "run") != before


# --- where pip comes from


@pytest.fixture
def mirror(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An index on disk with one file of pip's name."""
    page = tmp_path / "simple/pip"
    page.mkdir(parents=True)
    (page / NAME).write_bytes(WHEEL)
    listing = f'<a href="pip-1.0.tar.gz">old</a> <a href="./{NAME}#sha256=00">pip</a>'
    (page / "index.html").write_text(listing)
    monkeypatch.setattr(bootstrap, "urllib", SimpleNamespace(request=SimpleNamespace(urlopen=open_file)))
    monkeypatch.setenv("PIP_INDEX_URL", (tmp_path / "simple").as_uri())
    return page


def open_file(url: str, **_: object) -> BinaryIO:
    path = Path(unquote(urlsplit(url).path))
    return (path / "index.html" if path.is_dir() else path).open("rb")


@pytest.mark.parametrize("words", [[], ["nonsense"], ["run", "dev"]])
def test_wrong_usage_of_set_up_ends_with_2(words: list[str]) -> None:
    script = Path(bootstrap.__file__)
    done = subprocess.run([sys.executable, script, *words], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("usage: ")


def test_pip_comes_from_the_users_index(mirror: Path, tmp_path: Path) -> None:
    assert bootstrap.fetch_pip(LOCK, tmp_path).read_bytes() == WHEEL


def test_a_wrong_checksum_is_refused(mirror: Path, tmp_path: Path) -> None:
    (mirror / NAME).write_bytes(b"evil")
    with pytest.raises(bootstrap.SetupFailed, match="wrong checksum"):
        bootstrap.fetch_pip(LOCK, tmp_path)
    assert not (tmp_path / NAME).exists()


def test_an_index_without_pip_is_named(mirror: Path, tmp_path: Path) -> None:
    (mirror / "index.html").write_text("<a href='other.whl'>other</a>")
    with pytest.raises(bootstrap.SetupFailed, match="has no pip-26"):
        bootstrap.fetch_pip(LOCK, tmp_path)


def test_without_a_network_the_way_out_is_named(mirror: Path, tmp_path: Path) -> None:
    shutil.rmtree(mirror)
    with pytest.raises(bootstrap.SetupFailed, match="python3-venv"):
        bootstrap.fetch_pip(LOCK, tmp_path)


def test_the_likely_reason_is_named() -> None:
    assert "PIP_CERT" in bootstrap.hint("… CERTIFICATE_VERIFY_FAILED …")
    assert "750 MB" in bootstrap.hint("OSError: No space left on device")


@pytest.mark.parametrize(
    ("number", "says"),
    [(errno.EACCES, "Clone roboglot into"), (errno.EROFS, "Clone roboglot into"), (errno.EDQUOT, "750 MB")],
)
def test_unwritable_folder_is_named_with_the_way_out(number: int, says: str) -> None:
    words = bootstrap.in_words(OSError(number, os.strerror(number), "/srv/roboglot/.venv"))
    assert words.startswith(f"/srv/roboglot/.venv: {os.strerror(number)}. ")
    assert says in words
    assert "Errno" not in words


def test_failure_of_ensurepip_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = b"Traceback (most recent call last):\nOSError: [Errno 28] No space left on device\n"
    failing = Mock(side_effect=subprocess.CalledProcessError(1, "ensurepip", output))
    monkeypatch.setattr(bootstrap, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(venv, "EnvBuilder", lambda **_: Mock(create=failing))
    with pytest.raises(
        bootstrap.SetupFailed, match=r"^OSError: .* device\n.*ensurepip failed\. The disk is full: .* MB"
    ):
        bootstrap.make_venv()


@pytest.mark.parametrize(
    ("line", "package"),
    [
        ("Collecting anyio==4.16.0 (from -r run.lock (line 4))", "anyio==4.16.0"),
        (
            "Processing /opt/files/h11-0.16.0-py3-none-any.whl (from -r a/run.lock (line 9))",
            "h11-0.16.0-py3-none-any.whl",
        ),
        ("Requirement already satisfied: click==8.5.1 in ./lib/site-packages (8.5.1)", "click==8.5.1"),
    ],
)
def test_packages_are_counted_wherever_they_come_from(line: str, package: str) -> None:
    found = bootstrap.PACKAGE.match(line)
    assert found is not None
    assert found[1] == package


def test_packages_of_other_systems_are_not_counted() -> None:
    lock = "a==1 \\\n    --hash=sha256:00\ncolorama==1 ; sys_platform == 'win32' \\\nnumpy==2 ; x\nnumpy==3 ; y\n"
    assert bootstrap.package_names(lock) == {"a", "numpy"}


def test_making_venv_leaves_a_linked_one_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "another").mkdir()
    (tmp_path / "another/kept").touch()
    (tmp_path / ".venv").symlink_to(tmp_path / "another")
    make = venv.EnvBuilder
    monkeypatch.setattr(bootstrap, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(venv, "EnvBuilder", lambda **wanted: make(**wanted | {"with_pip": False}))
    monkeypatch.setattr(bootstrap, "find_spec", lambda _: True)
    bootstrap.make_venv()
    assert [file.name for file in (tmp_path / "another").iterdir()] == ["kept"]
    assert (tmp_path / ".venv/bin/python").exists()


# --- the lock files


def test_the_lock_files_are_in_step() -> None:
    assert locks.complaints(ROOT) == []


@pytest.fixture
def locked(tmp_path: Path) -> Path:
    """A copy of the real pyproject.toml and lock files, to spoil."""
    (tmp_path / "requirements").mkdir()
    for name in ("pyproject.toml", "requirements/run.lock", "requirements/dev.lock"):
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    return tmp_path


def test_a_new_requirement_asks_for_a_new_lock(locked: Path) -> None:
    pyproject = locked / "pyproject.toml"
    pyproject.write_text(pyproject.read_text().replace('"numpy>=2.0"', '"numpy>=2.1"'))
    assert len(locks.complaints(locked)) == 2


def test_a_comment_or_a_tools_setting_does_not(locked: Path) -> None:
    pyproject = locked / "pyproject.toml"
    pyproject.write_text("# hello\n" + pyproject.read_text().replace("line-length = 120", "line-length = 121"))
    assert locks.complaints(locked) == []


def test_pin_that_only_one_lock_has_is_reported(locked: Path) -> None:
    dev = locked / "requirements/dev.lock"
    dev.write_text(dev.read_text().replace("\nrich==", "\nrich==0+"))
    assert [line for line in locks.complaints(locked) if "doesn't hold rich==" in line]


def test_other_hashes_for_the_same_pin_are_reported(locked: Path) -> None:
    dev = locked / "requirements/dev.lock"
    good = next(iter(next(iter(locks.pins(dev.read_text()).values()))))
    dev.write_text(dev.read_text().replace(good, "sha256:" + "0" * 64))
    assert len(locks.complaints(locked)) == 1


def test_a_pin_without_a_hash_is_reported(locked: Path) -> None:
    run = locked / "requirements/run.lock"
    run.write_text(run.read_text() + "evil==1\n")
    assert "requirements/run.lock: evil==1 has no hash" in locks.complaints(locked)


def test_the_mark_is_written_once() -> None:
    once = locks.marked("a==1\n", "00")
    assert locks.marked(once, "11") == once.replace("00", "11")


# --- the version


@pytest.mark.parametrize(
    ("described", "version"),
    [("", "0.3.dev0"), ("v1.2.3", "1.2.3"), ("v1.2.3-4-g6b36cc8", "1.2.4.dev4")],
)
def test_archive_has_version_of_tag_or_fallback(tmp_path: Path, described: str, version: str) -> None:
    """``git archive`` and *Download ZIP* fill in .git_archival.txt, without a tag with an empty description."""
    (tmp_path / "pyproject.toml").write_bytes((ROOT / "pyproject.toml").read_bytes())
    text = (ROOT / ".git_archival.txt").read_text()
    node, date = "6b36cc855c1ff38b571e639def122cd3589fa27a", "2026-11-27T23:36:10+00:00"
    text = text.replace("$Format:%H$", node).replace("$Format:%cI$", date)
    (tmp_path / ".git_archival.txt").write_text(re.sub(r"\$Format:%\(describe.*\$", described, text))
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools_scm"]
    fallback, local = settings["fallback_version"], settings["local_scheme"]
    found = setuptools_scm.get_version(str(tmp_path), fallback_version=fallback, local_scheme=local)
    assert found == version


def test_libraries_just_written_leave_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Linux would map them in pieces of 2 MB: a robot's process took 131 MB instead of 118."""
    for name in ("numpy/_core/a.cpython-311-x86_64-linux-gnu.so", "mujoco/libmujoco.so.4.0.1", "numpy/a.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    forgotten = set[str]()
    monkeypatch.setattr(bootstrap, "VENV", tmp_path)
    monkeypatch.setattr(
        os, "posix_fadvise", lambda file, *_: forgotten.add(Path(f"/proc/self/fd/{file}").readlink().name)
    )
    bootstrap.forget_libraries()
    assert {Path(name).name for name in forgotten} == {"a.cpython-311-x86_64-linux-gnu.so", "libmujoco.so.4.0.1"}


@pytest.mark.parametrize(("figure", "missed"), [(4.9, False), (5.1, True), (0.0, False), (math.nan, True)])
def test_figure_beyond_its_limit_or_none_is_missed(figure: float, missed: bool) -> None:
    claims = Claims()
    claims.at_most("the figure", figure, 5.0, "s")
    with pytest.raises(SystemExit) as ended:
        claims.finish()
    assert bool(ended.value.code) is missed
