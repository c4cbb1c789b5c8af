"""Makes or repairs .venv so that it holds exactly what a lock file says: `bootstrap.py run` or `bootstrap.py dev`.

The scripts beside this file call it when the stamp in .venv doesn't fit (scripts/environment). pip comes from Python's
own ensurepip; a Python without it (Debian without python3-venv) gets the wheel that requirements/pip.lock pins from
PyPI, or from PIP_INDEX_URL. Everything else is pip's business, with the user's own settings. Standard library only.
"""

from __future__ import annotations

import sys

try:
    import fcntl
    import hashlib
    import os
    import re
    import ssl
    import subprocess
    import time
    import urllib.request
    import venv
    from importlib.util import find_spec
    from pathlib import Path
    from urllib.parse import urljoin
except ImportError as missing:
    sys.exit(
        f"roboglot: this Python ({sys.executable}) lacks its standard library ({missing.name}). Install it whole:\n"
        "    sudo apt-get install python3"
    )

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
PYTHON = VENV / "bin/python"
UNFINISHED = VENV / "unfinished"  # exists while packages are being written: a leftover means that they can't be trusted
PROFILES = ("run", "dev")  # dev includes all of run
INDEX = "https://pypi.org/simple"
PAGE_BYTES_MAX = 32 * 1024 * 1024
UNWANTED = {"PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_QUIET", "PIP_NO_BINARY", "PYTHONHOME", "PYTHONPATH"}
FULL = "The disk is full: about 750 MB are needed."
CLOSED = "Clone roboglot into a folder of your own, or have the owner of this one run scripts/run once."
HINTS = {
    "CERTIFICATE_VERIFY_FAILED": "Certificates aren't trusted: install ca-certificates, or name your own in PIP_CERT.",
    "No space left": FULL,
    "quota exceeded": FULL,
    "Permission denied": CLOSED,
    "Read-only file system": CLOSED,
}
# How pip begins a package: one of an index, a file on this machine, or one that is there.
PACKAGE = re.compile(r"(?:Collecting|Processing|Requirement already satisfied:) (?:\S*/)?(\S+)")


class SetupFailed(Exception):
    """The environment couldn't be made; the text is for the user."""


def say(text: str, end: str = "\n") -> None:
    start = "\r\x1b[K" if sys.stderr.isatty() else ""
    print(f"{start}roboglot: {text}", end=end, file=sys.stderr, flush=True)


def stamp(root: Path, profile: str) -> bytes:
    """Origin of .venv: two checksums, the place and the interpreter, in the form of scripts/environment."""
    names = f"requirements/{profile}.lock", "pyproject.toml"
    lines = [f"{hashlib.sha256((root / name).read_bytes()).hexdigest()}  {name}" for name in names]
    lines += [str(root), str((root / ".venv/bin/python").resolve())]
    return os.fsencode("".join(f"{line}\n" for line in lines))


def stamp_file(profile: str) -> Path:
    return VENV / f"stamp-{profile}"


def is_current(profile: str) -> bool:
    try:
        return PYTHON.exists() and stamp_file(profile).read_bytes() == stamp(ROOT, profile)
    except OSError:
        return False


def package_names(lock: str) -> set[str]:
    """The packages that a lock file names for this operating system."""
    lines = re.findall(r"^([A-Za-z0-9._-]+)==(.*)$", lock, re.MULTILINE)
    return {name for name, rest in lines if "sys_platform == 'win32'" not in rest}


def venv_is_sound() -> bool:
    """Return True if .venv is usable: finished, made in this place, its Python alive and of a supported version."""
    made_elsewhere = any(
        stamp_file(profile).exists() and stamp_file(profile).read_bytes().split(b"\n")[2:3] != [os.fsencode(ROOT)]
        for profile in PROFILES
    )
    if UNFINISHED.exists() or made_elsewhere:
        return False
    code = "import sys, pip; print(sys.prefix, (3, 11) <= sys.version_info[:2] <= (3, 14), sep='\\n')"
    try:
        done = subprocess.run([PYTHON, "-I", "-c", code], capture_output=True, text=True, timeout=60, check=True)
    except (OSError, subprocess.SubprocessError):
        return False
    prefix, supported = done.stdout.splitlines()
    return Path(prefix).resolve() == VENV.resolve() and supported == "True"


def make_venv() -> None:
    """An empty .venv that has pip, or at least the means to run it."""
    say(f"making .venv with Python {sys.version.split()[0]}")
    if VENV.is_symlink():
        VENV.unlink()  # what it leads to is another's, and would be emptied
    with_pip = find_spec("ensurepip") is not None
    try:
        venv.EnvBuilder(symlinks=True, clear=True, with_pip=with_pip).create(VENV)
    except subprocess.CalledProcessError as error:  # of ensurepip
        words = error.output.decode("utf-8", "replace").strip()
        raise SetupFailed(f"{words.rpartition(chr(10))[2]}\nPython's ensurepip failed. {hint(words, '')}") from None
    if not with_pip:
        wheel = fetch_pip((ROOT / "requirements/pip.lock").read_text(), VENV)
        pip("install", "--no-index", "--no-deps", str(wheel), runner=f"{wheel}/pip")


def fetch_pip(lock: str, folder: Path) -> Path:
    """The wheel of pip that the lock pins, by its SHA-256, from PyPI or PIP_INDEX_URL; SetupFailed without it."""
    version, digests = re.search(r"^pip==([\w.]+)", lock, re.MULTILINE), re.findall(r"sha256:([0-9a-f]{64})", lock)
    assert version is not None
    name = f"pip-{version[1]}-py3-none-any.whl"
    page = f"{os.environ.get('PIP_INDEX_URL', INDEX).rstrip('/')}/pip/"
    authority = os.environ.get("PIP_CERT")
    context = ssl.create_default_context(cafile=authority)
    if not authority and not context.get_ca_certs() and not ssl.get_default_verify_paths().cafile:
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # verified by checksum; pip has its own
    try:
        with urllib.request.urlopen(page, timeout=30, context=context) as answer:
            listing = answer.read(PAGE_BYTES_MAX).decode("utf-8", "replace")
        link = re.search(rf'href="([^"]*/)?({re.escape(name)})[^"]*"', listing)
        if link is None:
            raise SetupFailed(f"{page} has no {name}")
        with urllib.request.urlopen(urljoin(page, (link[1] or "") + link[2]), timeout=60, context=context) as answer:
            content = answer.read(PAGE_BYTES_MAX)
    except OSError as error:
        raise SetupFailed(
            f"pip can't be had from {page}: {error}. {hint(str(error))}\n"
            "Or install python3-venv, which brings it: sudo apt-get install python3-venv"
        ) from None
    if hashlib.sha256(content).hexdigest() not in digests:
        raise SetupFailed(f"{name} from {page} has the wrong checksum")
    (folder / name).write_bytes(content)
    return folder / name


def hint(text: str, otherwise: str = "Without a network? The first start needs one.") -> str:
    """The likely reason for a failure, and what to do, in a sentence."""
    found = [words for sign, words in HINTS.items() if sign in text]
    return found[0] if found else otherwise


def in_words(error: Exception) -> str:
    """Text of a failure, with its remedy."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or ROOT}: {error.strerror}. {hint(error.strerror, '')}".rstrip()
    return str(error)


def pip(*arguments: str, runner: str = "", total: int = 0, lock_fd: int | None = None) -> None:
    """Runs pip in .venv, counting packages of ``total``; SetupFailed with the end of its output if it fails."""
    environment = {key: value for key, value in os.environ.items() if key not in UNWANTED}
    if not os.access(environment.get("HOME") or "/nonexistent", os.W_OK):
        environment["PIP_NO_CACHE_DIR"] = "1"
    command = [str(PYTHON), *([runner] if runner else ["-m", "pip"]), *arguments, "--no-input", "--progress-bar=off"]
    tail: list[str] = []
    seen = 0
    with subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment | {"PIP_USER": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        pass_fds=() if lock_fd is None else (lock_fd,),  # if this process is killed and pip isn't, the next one waits
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            tail = [*tail, line.rstrip()][-200:]
            if package := PACKAGE.match(line):
                seen += 1
                if total and (sys.stderr.isatty() or seen % 10 == 0):
                    say(f"  package {seen} of {total}: {package[1]}", end="" if sys.stderr.isatty() else "\n")
            elif total and line.startswith("Installing collected"):
                say("  installing what was fetched")
    if process.returncode != 0:
        words = "\n".join(
            [line for line in tail if not (PACKAGE.match(line) or line.startswith((" ", "Ignoring ")))][-12:]
        )
        raise SetupFailed(f"{words}\npip failed. {hint(words)}")


def forget_libraries() -> None:
    """Has Linux drop the libraries just written from its cache, and read them anew when they are needed.

    It keeps files in the pieces in which they were written, up to 2 MB, and a process maps all of one that it touches:
    a robot's then takes 12 MB more.
    """
    for library in filter(Path.is_file, VENV.rglob("*.so*")):
        with library.open("rb") as file:
            os.fsync(file)  # only what is on the disk can be dropped
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def install(profile: str, lock_fd: int) -> None:
    if not venv_is_sound():
        make_venv()
    lock = ROOT / f"requirements/{profile}.lock"
    total = len(package_names(lock.read_text()))
    say(f"installing {total} packages from requirements/{profile}.lock (once; later starts need no network)")
    started = time.monotonic()
    UNFINISHED.touch()
    exact = ("--require-hashes", "--no-deps", "--only-binary=:all:", "--no-warn-script-location")
    pip("install", *exact, "-r", "requirements/pip.lock", lock_fd=lock_fd)
    pip("install", *exact, "-r", str(lock), total=total, lock_fd=lock_fd)
    pip("install", "--no-deps", "--no-build-isolation", "--no-index", "-e", str(ROOT), lock_fd=lock_fd)
    forget_libraries()
    UNFINISHED.unlink()
    # dev contains run with the same versions, which tests/test_scripts.py asserts.
    for each in PROFILES[: PROFILES.index(profile) + 1]:
        stamp_file(each).write_bytes(stamp(ROOT, each))
    say(f"set up in {time.monotonic() - started:.0f} s")


def set_up(profile: str) -> None:
    """Brings .venv in step with the profile's lock file, alone: others that come meanwhile wait and find it done."""
    lock_fd = os.open(ROOT, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("another set-up is at work here; waiting for it")
            fcntl.flock(lock_fd, fcntl.LOCK_EX)
        if not is_current(profile):
            install(profile, lock_fd)
    finally:
        os.close(lock_fd)


if __name__ == "__main__":
    if sys.argv[1:] not in [[profile] for profile in PROFILES]:
        print(f"usage: {sys.argv[0]} {'|'.join(PROFILES)}", file=sys.stderr)
        sys.exit(2)
    try:
        set_up(sys.argv[1])
    except (SetupFailed, OSError) as error:
        sys.exit(f"roboglot: the set-up failed: {in_words(error)}")
    except KeyboardInterrupt:
        say("interrupted; the next start repairs it.")
        sys.exit(130)
