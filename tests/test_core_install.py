"""The wheel with the core alone: clients and commands work; what lacks an extra says so in one sentence.

The environment is made without a network: the wheel is built here, and the packages of the core's requirements are
linked from this environment, nothing else.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
import venv
import zipfile
from collections import Counter
from collections.abc import Iterator
from importlib.metadata import Distribution, distribution, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from roboglot.console.assets import Assets
from roboglot.extras import EXTRA_OF, MODULES, UP, explained, own_version
from roboglot.testing.addresses import free_addresses
from roboglot.testing.process import served

ROOT = Path(__file__).resolve().parent.parent
# Of roboglot and all that its core requires; compiled packages are a little larger for later Pythons.
CORE_BYTES_MAX = 14 * 2**20 + (0 if sys.version_info < (3, 12) else 100_000)
HEAVY = set(EXTRA_OF)


def requirements(of: Distribution, found: set[str]) -> set[str]:
    """Everything that the distribution needs without an extra, here and now."""
    for line in of.requires or ():
        requirement = Requirement(line)
        if (requirement.marker is None or requirement.marker.evaluate({"extra": ""})) and requirement.name not in found:
            found.add(requirement.name)
            requirements(distribution(requirement.name), found)
    return found


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a fresh environment with the wheel and its core requirements."""
    folder = tmp_path_factory.mktemp("core")
    source = folder / "source"  # written by setuptools beside the build
    source.mkdir()
    shutil.copytree(ROOT / "src", source / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    for name in ("pyproject.toml", "README.md", "LICENSE", "NOTICE", "THIRD_PARTY_LICENSES.md"):
        if (ROOT / name).exists():
            shutil.copy(ROOT / name, source)
    code = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(folder)], cwd=source, check=True, timeout=120, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "venv", symlinks=True)
    python = folder / "venv/bin/python"
    (site,) = (folder / "venv/lib").glob("python*/site-packages")
    zipfile.ZipFile(wheel).extractall(site)  # steps of an installer for a pure wheel
    (metadata,) = site.glob("roboglot-*.dist-info")
    for name in requirements(Distribution.at(metadata), set()):
        for file in distribution(name).files or ():
            if ".." not in file.parts and "__pycache__" not in file.parts:
                target = site / file
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(file.locate(), target)
    return python


def run(core: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    return subprocess.run(
        [core, "-I", *arguments], capture_output=True, text=True, timeout=180, env=environment, cwd=core.parent
    )


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A robot of this environment that the other one's commands talk to; its address."""
    address = free_addresses(1)
    with served(tmp_path_factory.mktemp("up") / "data", "--no-console", address=address):
        yield address


@pytest.mark.slow
def test_the_core_is_small(core: Path) -> None:
    (site,) = core.parent.parent.glob("lib/python*/site-packages")
    files = [file for file in site.rglob("*") if file.is_file() and "__pycache__" not in file.parts]
    sizes = Counter[str]()
    for file in files:
        sizes[file.relative_to(site).parts[0]] += file.stat().st_size
    assert sizes.total() <= CORE_BYTES_MAX, sizes.most_common(10)
    assert not [name for name in HEAVY if (site / name).exists()]


def test_pages_in_a_wheel_equal_the_sources(core: Path) -> None:
    code = "from roboglot.console.assets import Assets; print(json.dumps({p: a.tag for p, a in Assets().all()}))"
    done = run(core, "-c", f"import json; {code}")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {path: asset.tag for path, asset in Assets().all()}


@pytest.mark.parametrize(
    "name",
    [
        "console/studio/labels.toml",
        "protocols/slamware/page/page.js",
        "simulation/worlds/office.toml",
        "storage/schema/v1.sql",
        "wire/contracts/slamware.json",
    ],
)
def test_texts_in_a_wheel_equal_the_sources(core: Path, name: str) -> None:
    code = "import sys, roboglot; from pathlib import Path; from roboglot.text_files import content_of"
    read = f"sys.stdout.buffer.write(content_of(Path(roboglot.__file__).parent / {name!r}))"
    done = run(core, "-c", f"{code}; {read}")
    assert done.stdout == (ROOT / "src/roboglot" / name).read_text("utf-8"), done.stderr


def test_the_start_screen_names_an_installed_file(core: Path) -> None:
    (proto,) = core.parent.parent.glob("lib/python*/site-packages/roboglot/wire/cyberdog/proto/cyberdog_app.proto")
    assert "service GrpcApp" in proto.read_text()  # grpcurl reads it, as the CyberDog door suggests


def test_importing_the_core_loads_nothing_heavy(core: Path) -> None:
    code = (
        "import sys, roboglot, roboglot.clients.slamware, roboglot.clients.robomaster.client, roboglot.clients.visual, "
        "roboglot.wire.slamware, roboglot.model.robot; print(*{name.partition('.')[0] for name in sys.modules})"
    )
    done = run(core, "-c", code)
    assert done.returncode == 0, done.stderr
    assert not HEAVY & set(done.stdout.split())


def test_version_says_what_is_there(core: Path) -> None:
    done = run(core, "-m", "roboglot", "--version")
    lines = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert done.returncode == 0, done.stderr
    assert lines["extras"] == "none: the core only"
    assert lines["missing"].startswith(" ".join(MODULES))
    assert "numba" in lines["kernels"]


def test_command_without_its_extra_names_the_remedy(core: Path, tmp_path: Path) -> None:
    data = "--data", str(tmp_path / "data")
    for extra, command, *arguments in (
        ("up", "up"),
        ("demo", "demo"),
        ("up", "coverage"),
        ("up", "capabilities"),
        ("up", "fleet", "up", "--worlds", "1", *data),
        ("up", "program", "run", __file__, "--own"),
        ("recording", "record", "slamware://127.0.0.1", "--listen", "127.0.0.9"),
        ("recording,logs", "export", "x.mcap", "--rosbag2", "bag"),
        ("cyberdog", "certs", "--export", str(tmp_path / "certs"), *data),
        ("cyberdog", "mirror", "cyberdog://127.0.0.1"),
    ):
        done = run(core, "-m", "roboglot", command, *arguments)
        assert done.returncode == 1
        (line,) = done.stderr.splitlines()
        assert f"roboglot {command} needs " in line
        assert line.endswith(f"pip install 'roboglot[{extra}]'")


def test_database_server_without_its_driver_names_the_remedy(core: Path) -> None:
    done = run(core, "-m", "roboglot", "access", "list", "--database", "postgresql://127.0.0.1/x")
    (line,) = done.stderr.splitlines()
    assert line.endswith("needs psycopg, which is not installed: pip install 'roboglot[postgresql]'")


def test_remedy_brings_what_is_missing() -> None:
    """A command's extra is named only for what it brings: with ``logs`` installed, its name would be no help."""
    for module, extra, remedy in (
        ("mcap", "logs", "recording"),
        ("mcap", "recording,logs", "recording,logs"),
        ("grpc", "recording", "cyberdog"),
        ("grpc", "demo", "demo"),
        ("llvmlite", "up", "up"),
    ):
        words = explained(ModuleNotFoundError(name=f"{module}.part"), "this", extra)
        assert words == f"this needs {module}, which is not installed: pip install 'roboglot[{remedy}]'"
    assert explained(ModuleNotFoundError(name="flask"), "this", "up") is None


def test_extras_of_up_are_those_of_the_package() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert extras["up"] == [f"roboglot[{','.join(UP)}]"]


def test_doctor_names_missing_extras(core: Path, tmp_path: Path) -> None:
    for security in ((), ("--security",)):
        done = run(core, "-m", "roboglot", "doctor", "--data", str(tmp_path), *security)
        assert done.stderr == ""
        assert ("roboglot[programs]" in done.stdout) == (not security)


def test_library_without_its_extra_names_the_remedy(core: Path) -> None:
    done = run(core, "-c", "import roboglot.clients.cyberdog")
    assert done.stderr.splitlines()[-1].endswith(
        "roboglot.clients.cyberdog needs grpc, which is not installed: pip install 'roboglot[cyberdog]'"
    )


@pytest.mark.usefixtures("vendor_ports")  # it listens for EPs, too
def test_scan_finds_a_robot(core: Path, robot: str) -> None:
    deadline = time.monotonic() + 60.0  # a busy machine answers some probes late
    while True:
        done = run(core, "-m", "roboglot", "scan", robot, "--seconds", "0.1")
        assert done.returncode == 0, done.stderr
        if f"slamware://{robot}" in done.stdout:
            break
        assert time.monotonic() < deadline, done.stdout


@pytest.mark.usefixtures("vendor_ports")
@pytest.mark.parametrize(("scheme", "row"), [("slamware", "in the map"), ("robomaster", "battery")])
def test_mirror_shows_a_robot(core: Path, robot: str, scheme: str, row: str) -> None:
    done = run(core, "-m", "roboglot", "mirror", f"{scheme}://{robot}", "--once")
    assert done.returncode == 0, done.stderr
    assert re.search(rf"^{row} ", done.stdout, re.MULTILINE), done.stdout
    if scheme == "slamware":
        assert "without scan and map" in done.stderr
        assert "pip install 'roboglot[slamware]'" in done.stderr


def test_clients_drive_a_robot(core: Path, robot: str) -> None:
    code = f"""
import asyncio
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.clients.slamware import SlamwareClient
from roboglot.model.clock import RealClock

async def main():
    async with SlamwareClient({robot!r}, 1448, clock=RealClock(), timeout=5.0) as client:
        print((await client.get_power_status()).battery_percentage)

asyncio.run(main())
"""
    done = run(core, "-c", code)
    assert done.returncode == 0, done.stderr
    assert 0 <= int(done.stdout) <= 100


def test_connect_asks_for_a_token_and_reports_absence(core: Path) -> None:
    assert "a token is needed" in run(core, "-m", "roboglot", "connect", "127.0.0.1:1").stderr
    token = core.parent / "token"
    token.write_text("x" * 40)
    done = run(core, "-m", "roboglot", "connect", "127.0.0.1:1", "--token-file", str(token), "--once")
    assert "Connect call failed" in done.stderr or "refused" in done.stderr.lower()


def test_the_version_is_that_of_the_installed_package() -> None:
    """Found without ``importlib.metadata``, which takes 20 ms of each start."""
    assert own_version() == version("roboglot")
