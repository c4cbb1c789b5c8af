"""Commands that start in forks of a warm parent: they end as if started cold, and leave nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from roboglot.__main__ import _start_warm
from roboglot.cli.warm import command
from roboglot.hosting import installation
from roboglot.hosting.installation import socket_path
from tests.workers.warm_start import COLD

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="forks of a warm parent are there on Linux only")

PATIENCE = 120.0
ONLY_OURS = {"PYTHONPATH": str(Path(installation.PACKAGE).parent)}
SAY = "import os, sys; print(os.getppid(), sys.argv[1:]); sys.exit(3)"
WAIT = "import os, time; print(os.getppid(), os.getpid(), flush=True); time.sleep(600)"
LIGHT = """
import os, sys
from roboglot.cli.warm import parent as warm_parent
warm_parent.COMMANDS = warm_parent.MODULES = warm_parent.PACKAGES = ()
warm_parent.IDLE = float(os.environ.get("IDLE", warm_parent.IDLE))
warm_parent.warm = lambda: None
serve = warm_parent.WarmParent.serve
warm_parent.WarmParent.serve = lambda parent: (print("up", flush=True), serve(parent))
warm_parent.main(sys.argv[1])
"""
FORKS_ONLY = """
import signal
from roboglot.cli.warm import parent as warm_parent
fork = warm_parent.fork
warm_parent.fork = lambda prepare: fork(prepare) and signal.pause() or 0
"""
ANNOUNCE = "import os, signal\nsignal.signal(signal.SIGINT, lambda *_: os.write(1, b'heard\\n'))\n"


class Place:
    """One user's runtime folder, with commands that start from its parent."""

    def __init__(self, folder: Path) -> None:
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), installation.WARM: "1", COLD: "1"}
        self.environment.pop("GRPC_VERBOSITY", None)  # the parent's own, or of a test before
        self.parents: list[subprocess.Popen[str]] = []

    def start(self, code: str, *words: str, files: Sequence[int] = (), **environment: str) -> subprocess.Popen[str]:
        """Start ``python -c`` from the warm parent."""
        command = [sys.executable, "-m", "roboglot.cli.warm.command", "-u", "-c", code, *words]
        whole = self.environment | environment
        pipe = subprocess.PIPE
        return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=whole, pass_fds=files)

    def open(self, before: str = "") -> int:
        """Start a parent that has loaded nothing, wait until it listens; return its process id."""
        command = [sys.executable, "-c", before + LIGHT, socket_path(self.environment)]
        parent = subprocess.Popen(command, env=self.environment, stdout=subprocess.PIPE, text=True)
        self.parents.append(parent)
        assert parent.stdout is not None
        assert parent.stdout.readline() == "up\n"
        return parent.pid

    def close(self) -> None:
        for parent in self.parents:
            with parent:
                parent.kill()

    def parent(self) -> int:
        """Return the process id of the parent that commands come from."""
        with self.start(SAY) as process:
            return int(process.communicate(timeout=PATIENCE)[0].split()[0])


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Place]:
    place = Place(tmp_path)
    place.open()
    yield place
    place.close()


def test_status_words_and_output_are_the_commands(place: Place) -> None:
    process = place.start(SAY, "--word", "ä")
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (3, "")
    assert out.split(maxsplit=1)[1] == "['--word', 'ä']\n"
    assert place.start("raise SystemExit('no')").communicate(timeout=PATIENCE) == ("", "no\n")


@pytest.mark.parametrize(("closed", "name"), [("<&-", "stdin"), (">&-", "stdout"), ("2>&-", "stderr")])
def test_file_that_is_closed_stays_closed(place: Place, tmp_path: Path, closed: str, name: str) -> None:
    found = tmp_path / "found"
    code = f"import pathlib, sys; pathlib.Path({str(found)!r}).write_text(str(sys.{name})); sys.exit(3)"
    words = ["sh", "-c", f'exec "$@" {closed}', "sh", sys.executable, "-m", "roboglot.cli.warm.command", "-c", code]
    done = subprocess.run(words, env=place.environment, timeout=PATIENCE, check=False)
    assert (done.returncode, found.read_text()) == (3, "None")


def test_a_command_has_its_callers_folder_and_environment(place: Place, tmp_path: Path) -> None:
    code = "import os, time; print(time.tzname[0], os.getcwd(), os.environ['WORD'], oct(os.umask(0)), "
    code += "os.environ.get('GRPC_VERBOSITY'))"
    process = place.start(f"import os; os.chdir({str(tmp_path)!r}); " + code, WORD="here", TZ="XYZ-3")
    assert process.communicate(timeout=PATIENCE)[0].split() == ["XYZ", str(tmp_path), "here", oct(umask()), "None"]


def test_a_command_has_the_shells_files(place: Place) -> None:
    """``roboglot test <(…)`` reads /dev/fd/63."""
    reading, writing = os.pipe()
    os.dup2(reading, 63)
    os.write(writing, b"from the shell")
    os.close(writing)
    try:
        code = "import os; print(open('/dev/fd/63').read(), os.listdir('/proc/self/fd'))"
        process = place.start(code, files=[63])
        out, err = process.communicate(timeout=PATIENCE)
    finally:
        os.close(reading)
        os.close(63)
    assert (out, err) == ("from the shell ['0', '1', '2', '3', '63']\n", "")


def test_a_caller_with_other_rights_is_refused(place: Place) -> None:
    """A sandbox that can reach the socket gains nothing by it."""
    path = socket_path(place.environment)
    sandboxed = "import ctypes; ctypes.CDLL(None).prctl(38, 1, 0, 0, 0)\n"  # PR_SET_NO_NEW_PRIVS
    sandboxed += "from roboglot.cli.warm import command as w\nw.launch = print\n"
    sandboxed += f"w.installation.socket_path = lambda _: {path!r}\nprint(w.run(w.CODE, ['pass']))"
    asked = [sys.executable, "-c", sandboxed]
    done = subprocess.run(asked, env=place.environment, capture_output=True, text=True, check=True)
    assert done.stdout == f"{path}\nNone\n"
    assert place.parent() == place.parents[0].pid


def test_another_priority_has_a_parent_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also for the lowest: from there ``os.nice`` leads nowhere."""
    found = set()
    for niceness in (0, 18, 19):
        monkeypatch.setattr(os, "getpriority", lambda *_, niceness=niceness: niceness)
        found.add(socket_path({"XDG_RUNTIME_DIR": str(tmp_path)}))
    assert len(found) == 3


def test_path_too_long_for_a_socket_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="too long"):
        socket_path({"XDG_RUNTIME_DIR": str(tmp_path / ("long" * 30))})


def test_a_changed_class_file_changes_the_stamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(installation, "PACKAGE", tmp_path)
    body = tmp_path / "bodies" / "own.toml"
    body.parent.mkdir()
    body.write_text("mass = 1\n")
    before = installation.stamp()
    body.write_text("mass = 10\n")
    assert installation.stamp() != before


def umask() -> int:
    os.umask(found := os.umask(0))
    return found


def test_a_signal_to_the_caller_reaches_the_command(place: Place) -> None:
    with place.start(ANNOUNCE + WAIT) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "heard\n"
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE) == -signal.SIGTERM


def test_a_killed_caller_leaves_no_command(place: Place) -> None:
    with place.start(WAIT) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline().split()[1])
        process.kill()
        until(lambda: not is_running(pid))


def test_killed_parent_leaves_no_command_no_lock(place: Place) -> None:
    with place.start(WAIT) as process:
        assert process.stdout is not None
        parent, pid = map(int, process.stdout.readline().split())
        os.kill(parent, signal.SIGKILL)
        assert process.wait(PATIENCE) != 0
        assert process.stderr is not None
        assert "has ended" in process.stderr.read()
    until(lambda: not is_running(pid))
    assert place.open() == place.parent() != parent  # the dead one's socket is still there


def test_command_that_began_is_not_started_again(tmp_path: Path) -> None:
    """The parent is killed before it could do more than fork."""
    place = Place(tmp_path)
    parent = place.open(FORKS_ONLY)
    with place.start(WAIT) as process:
        assert process.stdout is not None
        assert int(process.stdout.readline().split()[0]) == parent
        os.kill(parent, signal.SIGKILL)
        assert process.stdout.read() == ""
        assert process.wait(PATIENCE) == command.BROKEN
    place.close()


def test_changed_sources_end_the_parent(place: Place) -> None:
    changed = "from roboglot.cli.warm import command as w\nw.installation.stamp = lambda: 'changed'\n"
    asked = [sys.executable, "-c", changed + "w.launch = print\nw.run(w.CODE, ['pass'])"]
    launched = subprocess.run(asked, env=place.environment, capture_output=True, text=True, check=True).stdout
    assert launched.strip() == socket_path(place.environment)
    assert place.parents[0].wait(PATIENCE) == 0
    assert place.open() == place.parent()


def test_one_parent_is_enough(place: Place) -> None:
    command = [sys.executable, "-c", LIGHT, socket_path(place.environment)]
    assert subprocess.run(command, env=place.environment, capture_output=True, text=True, check=True).stdout == ""
    assert place.parent() == place.parents[0].pid


def test_an_idle_parent_ends_and_its_socket_goes(tmp_path: Path) -> None:
    place = Place(tmp_path)
    place.environment["IDLE"] = "0.01"
    place.open()
    assert place.parents[0].wait(PATIENCE) == 0
    assert not Path(socket_path(place.environment)).exists()
    place.close()


@pytest.mark.parametrize(
    ("line", "asks"),
    [("test x.yaml", True), ("lesson x.toml", True), ("program run x.py --own", True), ("program run x.py", False)],
)
def test_commands_with_own_robots_ask_a_parent(monkeypatch: pytest.MonkeyPatch, line: str, asks: bool) -> None:
    asked: list[tuple[str, list[str]]] = []
    monkeypatch.setattr(command, "run", lambda kind, words: asked.append((kind, words)))
    _start_warm(line.split())
    assert asked == ([(command.COMMAND, line.split())] if asks else [])


def test_asking_a_parent_loads_nothing_large() -> None:
    """Each of these takes a tenth of the time that a forked command has to start."""
    code = "import sys; from roboglot.cli.warm import command; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-S", "-c", code], env=ONLY_OURS, capture_output=True, text=True, check=True
    )
    assert not {"typing", "re", "json", "pathlib", "hashlib", "_hashlib", "typer"} & set(loaded.stdout.split())


@pytest.mark.slow  # test_commands_with_own_robots_ask_a_parent, and all of these with a parent that has loaded nothing
def test_a_program_on_its_own_robot_starts_warm(tmp_path: Path) -> None:
    """The first run is cold and starts a parent; a later one is its child."""
    place, program = Place(tmp_path), tmp_path / "hello.py"
    program.write_text("print('hello')\n")
    command = [sys.executable, "-m", "roboglot", "program", "run", str(program), "--own", "--world", "empty"]
    for _ in range(2):
        done = subprocess.run(command, env=place.environment, capture_output=True, text=True, check=True)
        assert done.stdout == "hello\n"
        until(Path(socket_path(place.environment)).exists)
    os.kill(place.parent(), signal.SIGKILL)


def test_another_users_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "roboglot").mkdir()
    (tmp_path / "roboglot").chmod(0o755)  # readable by others, with any umask
    with pytest.raises(PermissionError):
        installation.folder_of({"XDG_RUNTIME_DIR": str(tmp_path)})


@pytest.mark.parametrize(
    ("environment", "wanted"),
    [({}, True), ({"CI": "true"}, False), ({"JENKINS_URL": "http://ci"}, False), ({"ROBOGLOT_WARM": "0"}, False)],
)
def test_no_parent_is_started_in_ci(environment: dict[str, str], wanted: bool) -> None:
    assert installation.is_wanted(environment) is wanted
