"""Makes or repairs .venv so that it holds exactly what a lock file says: `bootstrap.py run` or `bootstrap.py dev`.

The scripts beside this file call it when the stamp in .venv doesn't fit (scripts/environment). Works on a Python
without pip, ensurepip or setuptools; standard library only. Knows nothing about what the robot is; how pip is found
is in pip_wheel.py.
"""

from __future__ import annotations

import sys

try:
    import fcntl
    import hashlib
    import os
    import re
    import selectors
    import subprocess
    import time
    import venv
    from collections.abc import Iterator
    from dataclasses import dataclass, field
    from pathlib import Path

    import pip_wheel
except ImportError as missing:
    sys.exit(
        f"roboglot: this Python ({sys.executable}) lacks its standard library ({missing.name}). Install it whole:\n"
        "    sudo apt-get install python3"
    )

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
UNFINISHED = VENV / "unfinished"  # exists while packages are being written: what lies there then can't be trusted
OUTPUT_LINES_MAX = 400
PROFILES = ("run", "dev")  # dev holds all of run


class SetupFailed(Exception):
    """The environment couldn't be made; the text is for the user."""


@dataclass(slots=True)
class Progress:
    """Says on stderr what goes on: a line that moves on a terminal, a line per quarter elsewhere."""

    moving: bool = field(default_factory=lambda: sys.stderr.isatty())
    _last: str = ""

    def phase(self, text: str) -> None:
        self._end_line()
        print(f"roboglot: {text}", file=sys.stderr, flush=True)
        self._last = ""

    def step(self, verb: str, done: int, total: int, name: str = "") -> None:
        percent = min(100, 100 * done // max(1, total))
        if self.moving:
            text = f"  {verb} {done}/{total} ({percent} %) {name}"[:100]
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
            self._last = "moving"
        elif (quarter := f"{verb} {percent // 25 * 25}") != self._last:
            print(f"  {verb} {done}/{total} ({percent} %)", file=sys.stderr, flush=True)
            self._last = quarter

    def _end_line(self) -> None:
        if self._last == "moving":
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def stamp(root: Path, profile: str) -> bytes:
    """What .venv was made from: two checksums, the place and the interpreter, as scripts/environment writes it too."""
    lines = []
    for name in (f"requirements/{profile}.lock", "pyproject.toml"):
        lines.append(f"{hashlib.sha256((root / name).read_bytes()).hexdigest()}  {name}")
    lines += [str(root), str((root / ".venv/bin/python").resolve())]
    return os.fsencode("".join(f"{line}\n" for line in lines))


def stamp_file(profile: str) -> Path:
    return VENV / f"stamp-{profile}"


def is_current(profile: str) -> bool:
    try:
        return VENV.joinpath("bin/python").exists() and stamp_file(profile).read_bytes() == stamp(ROOT, profile)
    except OSError:
        return False


def package_names(lock: str) -> set[str]:
    """The packages that a lock file names for this operating system."""
    lines = re.findall(r"^([A-Za-z0-9._-]+)==(.*)$", lock, re.MULTILINE)
    return {name for name, rest in lines if "sys_platform == 'win32'" not in rest}


def supported(version: tuple[int, int]) -> bool:
    return (3, 11) <= version <= (3, 14)


def venv_is_sound() -> bool:
    """Whether .venv can be built upon: finished, made in this place, its Python alive and of a supported version."""
    if UNFINISHED.exists():
        return False
    for profile in PROFILES:
        if stamp_file(profile).exists():
            place = stamp_file(profile).read_bytes().split(b"\n")[2:3]
            if place != [os.fsencode(str(ROOT))]:
                return False
    code = "import sys; print(sys.prefix); print(*sys.version_info[:2])"
    try:
        done = subprocess.run(
            [VENV / "bin/python", "-I", "-c", code], capture_output=True, text=True, timeout=60, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return False
    prefix, version = done.stdout.splitlines()
    major, minor = map(int, version.split())
    return Path(prefix).resolve() == VENV.resolve() and supported((major, minor))


def pip_environment() -> dict[str, str]:
    """The user's own settings without those that would lead pip out of the environment or silence it."""
    unwanted = {"PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_QUIET", "PIP_NO_BINARY", "PYTHONHOME", "PYTHONPATH"}
    kept = {key: value for key, value in os.environ.items() if key not in unwanted}
    home = kept.get("HOME", "")
    if not (os.path.isdir(home) and os.access(home, os.W_OK)):
        kept["PIP_NO_CACHE_DIR"] = "1"
    return kept | {"PIP_USER": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONUNBUFFERED": "1"}


def _lines(process: subprocess.Popen[bytes], every_s: float) -> Iterator[str]:
    """The process's lines as they come, and an empty one whenever nothing came for a while."""
    assert process.stdout is not None
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        rest = b""
        while True:
            if not selector.select(every_s):
                yield ""
                continue
            block = os.read(process.stdout.fileno(), 65536)
            if not block:
                break
            *whole, rest = (rest + block).split(b"\n")
            yield from (line.decode("utf-8", "replace") for line in whole if line.strip())
    if rest:
        yield rest.decode("utf-8", "replace")


@dataclass(slots=True)
class PipReport:
    """Turns pip's output into progress; keeps the end of it for the error message."""

    total: int
    progress: Progress
    collected: int = 0
    installed_before: int = 0
    installing: bool = False
    name: str = ""
    tail: list[str] = field(default_factory=list)

    def read(self, line: str) -> None:
        if moved := re.match(r"Progress (\d+) of (\d+)", line):
            megabytes = f"{self.name} {int(moved[1]) / 1e6:.1f} of {int(moved[2]) / 1e6:.1f} MB"
            self.progress.step("downloading", self.collected, self.total, megabytes)
            return
        if line:
            self.tail = [*self.tail, line][-OUTPUT_LINES_MAX:]
        if started := re.match(r"(?:Collecting|Requirement already satisfied:) ([\w.-]+)", line):
            self.collected += 1
            self.name = started[1]
            self.progress.step("downloading", self.collected, self.total, self.name)
        elif line.startswith("Installing collected packages"):
            self.installing = True
            self.installed_before = self._installed()
            self.total = max(1, line.count(",") + 1)
        if self.installing:
            self.progress.step("installing", self._installed() - self.installed_before, self.total)

    def last_words(self) -> str:
        noise = ("Ignoring ", "WARNING: Retrying", "Collecting ", "  ")
        return "\n".join([line for line in self.tail if not line.startswith(noise)][-12:])

    @staticmethod
    def _installed() -> int:
        return sum(1 for _ in VENV.glob("lib/python3*/site-packages/*.dist-info/RECORD"))


def hint(lines: list[str]) -> str:
    """The likely reason for a failure to get packages, and what to do, in a sentence."""
    if any("CERTIFICATE_VERIFY_FAILED" in line for line in lines):
        return "Certificates aren't trusted: install ca-certificates, or name your network's own in PIP_CERT."
    if any("No space left" in line for line in lines):
        return "The disk is full: about 700 MB are needed."
    return "Without a network? The first start needs one."


def run_pip(wheel: Path, arguments: list[str], report: PipReport, lock_fd: int) -> None:
    """Runs pip from its wheel inside .venv; SetupFailed with the end of its output if it fails."""
    command = [str(VENV / "bin/python"), f"{wheel}/pip", "install", "--no-input", "--no-warn-script-location"]
    process = subprocess.Popen(
        [*command, "--progress-bar=raw", *arguments],
        cwd=ROOT,
        env=pip_environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        pass_fds=(lock_fd,),  # if this process is killed and pip isn't, the next one waits for pip
    )
    try:
        for line in _lines(process, every_s=0.5):
            report.read(line)
    except BaseException:
        process.terminate()
        raise
    finally:
        process.wait()
    if process.returncode != 0:
        if not report.installing:
            UNFINISHED.unlink(missing_ok=True)  # nothing was written
        raise SetupFailed(f"{report.last_words()}\npip failed. {hint(report.tail)}")


def install(profile: str, progress: Progress, lock_fd: int) -> None:
    if not venv_is_sound():
        progress.phase(f"making .venv with Python {sys.version.split()[0]}")
        venv.EnvBuilder(symlinks=True, clear=True, with_pip=False).create(VENV)
    pin = pip_wheel.read_pin((ROOT / "requirements/pip.lock").read_text())
    try:
        wheel = pip_wheel.get_wheel(pin, VENV, pip_wheel.pip_settings(os.environ, pip_wheel.config_files(os.environ)))
    except pip_wheel.WheelUnavailable as error:
        raise SetupFailed(f"{error}\npip can't be had. {hint([str(error)])}") from error
    lock = ROOT / f"requirements/{profile}.lock"
    total = len(package_names(lock.read_text()))
    progress.phase(f"installing {total} packages from requirements/{profile}.lock (once; later starts need no network)")
    UNFINISHED.touch()
    exact = ["--require-hashes", "--no-deps", "--only-binary=:all:", "-r", str(lock)]
    run_pip(wheel, exact, PipReport(total, progress), lock_fd)
    progress.phase("installing roboglot itself")
    here = ["--no-deps", "--no-build-isolation", "--no-index", "-e", str(ROOT), str(wheel)]  # pip, for what users add
    run_pip(wheel, here, PipReport(1, progress), lock_fd)
    UNFINISHED.unlink()
    # dev contains run with the same versions, which tests/test_scripts.py asserts.
    for each in PROFILES[: PROFILES.index(profile) + 1]:
        stamp_file(each).write_bytes(stamp(ROOT, each))


def set_up(profile: str) -> None:
    """Brings .venv in step with the profile's lock file, alone: others that come meanwhile wait and find it done."""
    if is_current(profile):
        return
    progress = Progress()
    lock_fd = os.open(ROOT, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            progress.phase("another set-up is at work here; waiting for it")
            fcntl.flock(lock_fd, fcntl.LOCK_EX)
        if is_current(profile):
            return
        started = time.monotonic()
        install(profile, progress, lock_fd)
        progress.phase(f"set up in {time.monotonic() - started:.0f} s")
    finally:
        os.close(lock_fd)


def main() -> int:
    if len(sys.argv) != 2 or sys.argv[1] not in PROFILES:
        print(f"usage: {sys.argv[0]} {'|'.join(PROFILES)}", file=sys.stderr)
        return 2
    try:
        set_up(sys.argv[1])
    except SetupFailed as error:
        print(f"roboglot: the set-up failed.\n{error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"roboglot: the set-up failed: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nroboglot: interrupted; the next start repairs it.", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
