"""The scripts' pure parts: what they decide, without a network and without making an environment."""

import hashlib
import os
import ssl
import subprocess
from pathlib import Path

import bootstrap
import locks
import pip_wheel
import pytest

ROOT = Path(__file__).resolve().parent.parent
WHEEL = b"not really a wheel"
PIN = pip_wheel.Pin("pip-26.3-py3-none-any.whl", frozenset({hashlib.sha256(WHEEL).hexdigest()}))


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


def environment(root: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Runs `environment run` of the clone's scripts/environment."""
    return subprocess.run(
        ["bash", "-c", 'source "$1/scripts/environment"; environment run; echo went on', "bash", str(root)],
        env={"PATH": os.environ["PATH"], **variables},
        capture_output=True,
        text=True,
        timeout=30,
    )


def test_bash_and_python_write_the_same_stamp(clone: Path) -> None:
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    done = environment(clone, PYTHON="/bin/false")
    assert (done.returncode, done.stdout, done.stderr) == (0, "went on\n", "")


def test_kernels_are_compiled_again_when_their_source_is_newer(clone: Path) -> None:
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    os.utime(clone / ".venv/kernels", (1, 1))
    (clone / "src/roboglot/kernels/search.py").write_text("# newer\n")
    done = environment(clone)
    assert done.stdout == "went on\n"
    assert "compiling the numeric kernels" in done.stderr


@pytest.mark.parametrize("changed", ["requirements/run.lock", "pyproject.toml"])
def test_a_changed_file_asks_for_a_new_set_up(clone: Path, changed: str) -> None:
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    with (clone / changed).open("a") as file:
        file.write("# more\n")
    done = environment(clone, PYTHON="/bin/false")
    assert done.returncode == 1
    assert "needs Python 3.11 to 3.14; tried /bin/false" in done.stderr


def test_a_python_that_is_gone_asks_for_a_new_set_up(clone: Path) -> None:
    (clone / ".venv/bin/python").unlink()
    (clone / ".venv/bin/python").symlink_to(clone / "gone")
    (clone / ".venv/stamp-run").write_bytes(bootstrap.stamp(clone, "run"))
    assert environment(clone, PYTHON="/bin/false").returncode == 1


def test_a_moved_clone_has_another_stamp(clone: Path) -> None:
    before = bootstrap.stamp(clone, "run")
    moved = clone.rename(clone.parent / "elsewhere")
    assert bootstrap.stamp(moved, "run") != before


# --- where pip comes from


def test_the_environment_rules_over_the_files_and_install_over_global(tmp_path: Path) -> None:
    first, second = tmp_path / "first.conf", tmp_path / "second.conf"
    first.write_text("[global]\nindex_url = https://first/simple\ntimeout = 9\n[install]\nproxy = http://p:1\n")
    second.write_text("[global]\nindex-url = https://second/simple\nproxy = http://q:1\n")
    settings = pip_wheel.pip_settings({"PIP_TIMEOUT": "3", "PIP_CERT": ""}, [first, tmp_path / "none.conf", second])
    assert settings == {"index-url": "https://second/simple", "timeout": "3", "proxy": "http://p:1"}


def test_a_broken_configuration_file_is_skipped(tmp_path: Path) -> None:
    broken = tmp_path / "pip.conf"
    broken.write_bytes(b"\xff\xfe no section")
    assert pip_wheel.pip_settings({}, [broken]) == {}


def test_configuration_files_in_pips_order() -> None:
    files = pip_wheel.config_files({"HOME": "/h", "PIP_CONFIG_FILE": "/own.conf", "XDG_CONFIG_DIRS": "/strong:/weak"})
    assert [str(file) for file in files] == [
        "/weak/pip/pip.conf",
        "/strong/pip/pip.conf",
        "/etc/pip.conf",
        "/h/.pip/pip.conf",
        "/h/.config/pip/pip.conf",
        "/own.conf",
    ]
    assert pip_wheel.config_files({"HOME": "/h", "PIP_CONFIG_FILE": os.devnull}) == []


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({}, ["https://pypi.org/simple/pip/"]),
        ({"index-url": "https://m/simple/"}, ["https://m/simple/pip/"]),
        (
            {"find-links": "/wheels https://l/", "extra-index-url": "https://e/s"},
            ["/wheels", "https://l/", "https://pypi.org/simple/pip/", "https://e/s/pip/"],
        ),
        ({"no-index": "1", "find-links": "/wheels"}, ["/wheels"]),
        ({"no-index": "0"}, ["https://pypi.org/simple/pip/"]),
    ],
)
def test_the_places_to_look(settings: dict[str, str], expected: list[str]) -> None:
    assert pip_wheel.pages(settings) == expected


@pytest.mark.parametrize(
    ("link", "expected"),
    [
        ("../../f/pip-26.3-py3-none-any.whl#sha256=00", "https://m/root/f/pip-26.3-py3-none-any.whl"),
        ("https://files/pip-26.3-py3-none-any.whl?t=1", "https://files/pip-26.3-py3-none-any.whl?t=1"),
        ("pip%2D26.3-py3-none-any.whl", "https://m/root/simple/pip/pip%2D26.3-py3-none-any.whl"),
        ("pip-26.3.tar.gz", None),
        ("pip-26.3-py3-none-any.whl.metadata", None),
        ("other/xpip-26.3-py3-none-any.whl", None),
    ],
)
def test_the_wheel_on_an_index_page(link: str, expected: str | None) -> None:
    html = f'<html><a name="x">no link</a><a data-x="1" href="{link}">a</a>'
    assert pip_wheel.find_wheel(html, "https://m/root/simple/pip/", PIN.filename) == expected


def test_credentials_leave_the_url() -> None:
    assert pip_wheel.split_credentials("https://me:p%40ss@m:8443/simple/") == ("https://m:8443/simple/", "me:p@ss")


def test_a_mirror_on_disk_gives_the_wheel(tmp_path: Path) -> None:
    mirror = tmp_path / "simple/pip"
    mirror.mkdir(parents=True)
    (mirror / "index.html").write_text(f'<a href="{PIN.filename}">pip</a>')
    (mirror / PIN.filename).write_bytes(WHEEL)
    target = tmp_path / "venv"
    target.mkdir()
    wheel = pip_wheel.get_wheel(PIN, target, {"index-url": (tmp_path / "simple").as_uri()})
    assert wheel.read_bytes() == WHEEL
    assert sorted(file.name for file in target.iterdir()) == [PIN.filename]


def test_a_wrong_checksum_is_refused_and_the_next_place_is_asked(tmp_path: Path) -> None:
    bad, good, target = (tmp_path / name for name in ("bad", "good", "target"))
    for folder, content in ((bad, b"evil"), (good, WHEEL)):
        folder.mkdir()
        (folder / PIN.filename).write_bytes(content)
    target.mkdir()
    with pytest.raises(pip_wheel.WheelUnavailable, match="wrong checksum"):
        pip_wheel.get_wheel(PIN, target, {"no-index": "1", "find-links": str(bad)})
    assert list(target.iterdir()) == []
    wheel = pip_wheel.get_wheel(PIN, target, {"no-index": "1", "find-links": f"{bad} {good}"})
    assert wheel.read_bytes() == WHEEL


def test_a_damaged_wheel_in_the_environment_is_fetched_again(tmp_path: Path) -> None:
    (tmp_path / PIN.filename).write_bytes(WHEEL[:5])
    with pytest.raises(pip_wheel.WheelUnavailable, match="no package index"):
        pip_wheel.get_wheel(PIN, tmp_path, {"no-index": "1"})
    (tmp_path / PIN.filename).write_bytes(WHEEL)
    assert pip_wheel.get_wheel(PIN, tmp_path, {"no-index": "1"}) == tmp_path / PIN.filename


def test_secrets_never_go_to_an_unchecked_server(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pip_wheel, "_has_certificates", lambda: False)
    for name in ("REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE"):
        monkeypatch.delenv(name, raising=False)
    assert pip_wheel._context("https://m/simple", {}, secret=True).verify_mode is ssl.CERT_REQUIRED
    assert pip_wheel._context("https://m/simple", {}, secret=False).verify_mode is ssl.CERT_NONE


def test_the_pin_is_read_from_the_lock() -> None:
    pin = pip_wheel.read_pin((ROOT / "requirements/pip.lock").read_text())
    assert pin.filename.startswith("pip-")
    assert pin.digests
    with pytest.raises(ValueError, match="no pip"):
        pip_wheel.read_pin("pip==1.0\n")


# --- pip's output


def test_pips_output_becomes_progress(capsys: pytest.CaptureFixture[str]) -> None:
    report = bootstrap.PipReport(4, bootstrap.Progress(moving=False))
    for line in ("Collecting a==1", "Progress 5 of 10", "Collecting b==1", "", "Collecting c==1", "Collecting d==1"):
        report.read(line)
    assert not report.installing
    report.read("Installing collected packages: a, b, c, d")
    assert report.installing
    lines = capsys.readouterr().err.splitlines()
    assert [line.strip() for line in lines[:4]] == [
        "downloading 1/4 (25 %)",
        "downloading 2/4 (50 %)",
        "downloading 3/4 (75 %)",
        "downloading 4/4 (100 %)",
    ]


def test_the_last_words_leave_out_the_noise() -> None:
    report = bootstrap.PipReport(
        1, bootstrap.Progress(moving=False), tail=["Collecting a", "WARNING: Retrying", "ERROR: x"]
    )
    assert report.last_words() == "ERROR: x"
    assert "PIP_CERT" in bootstrap.hint(["… CERTIFICATE_VERIFY_FAILED …"])


def test_packages_of_other_systems_are_not_counted() -> None:
    lock = "a==1 \\\n    --hash=sha256:00\ncolorama==1 ; sys_platform == 'win32' \\\nnumpy==2 ; x\nnumpy==3 ; y\n"
    assert bootstrap.package_names(lock) == {"a", "numpy"}


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


def test_a_pin_that_only_one_lock_has_is_told(locked: Path) -> None:
    dev = locked / "requirements/dev.lock"
    dev.write_text(dev.read_text().replace("\nrich==", "\nrich==0+"))
    assert [line for line in locks.complaints(locked) if "doesn't hold rich==" in line]


def test_other_hashes_for_the_same_pin_are_told(locked: Path) -> None:
    dev = locked / "requirements/dev.lock"
    good = next(iter(next(iter(locks.pins(dev.read_text()).values()))))
    dev.write_text(dev.read_text().replace(good, "sha256:" + "0" * 64))
    assert len(locks.complaints(locked)) == 1


def test_a_pin_without_a_hash_is_told(locked: Path) -> None:
    run = locked / "requirements/run.lock"
    run.write_text(run.read_text() + "evil==1\n")
    assert "requirements/run.lock: evil==1 has no hash" in locks.complaints(locked)


def test_the_mark_is_written_once() -> None:
    once = locks.marked("a==1\n", "00")
    assert locks.marked(once, "11") == once.replace("00", "11")
