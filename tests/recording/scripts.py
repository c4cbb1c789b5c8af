"""Scripts of ours as their users have them: of the pages, the examples and the command line, in all four protocols.

Each is typed in bash beside a robot. Only addresses, and the port on which an app is called, are those of the test.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from tests.docs.docs_terminal import ROOT, Terminal, commands
from tests.docs.test_docs import blocks
from tests.docs.test_docs_first_calls import NEEDS, RUN, SUFFIX, first_call

DOCS = ROOT / "docs"
PYTHON = sys.executable
CERTIFICATES = ".venv/bin/roboglot certs --export phone"
ASK = f"{PYTHON} examples/cyberdog_ask.py"
REST, TEXT, DOG, FRAMES = "slamware", "robomaster", "cyberdog", "visual"
APP_PORT = 8981  # called by a dog


@dataclass(frozen=True)
class Script:
    """``lines`` are typed one after the other, ``files`` lie in the folder; ``code`` is asyncio that a page prints.

    ``door``: the protocol that it speaks. ``printed``: how many lines the code prints until it is ended; 0: it ends.
    ``two_lines``: it prints what comes on two connections, as it comes. ``random``: what of its output is of that run
    alone, as an expression.
    """

    door: str
    lines: Sequence[str] = ()
    files: dict[str, str] = field(default_factory=dict)
    code: str = ""
    printed: int = 0
    body: str = "universal"
    needs: str = "bash"
    random: str = ""
    two_lines: bool = False
    slow: bool = False

    @property
    def later(self) -> Script:
        """The same among the slow ones."""
        return replace(self, slow=True)


def block(page: str, words: str, language: str = "sh") -> str:
    """Return the one block of a page that has these words."""
    [found] = [block for block in blocks(DOCS / page, language) if words in block]
    return found


def lines_of(page: str, words: str, *without: str) -> list[str]:
    """Return the commands of a block of a page, its variables before each."""
    found, variables = list[str](), ""
    for command in commands(block(page, words)):
        if command.partition("=")[0].isidentifier():
            variables += command + "\n"
        elif not any(word in command for word in without):
            found.append(variables + command)
    return found


def first(door: str, language: str) -> Script:
    """Return the first call of a door's page."""
    before = [CERTIFICATES] if door == DOG else []
    files = {f"first.{SUFFIX[language]}": first_call(f"{door}.md", language)}
    return Script(door, [*before, f"ANSWERS=3; {RUN[language]}"], files, needs=NEEDS[language])


def program(name: str) -> Script:
    """Return a block program of the examples, run by the command line."""
    return Script(FRAMES, [f".venv/bin/roboglot program run examples/programs/{name}.py"], body="cyberdog2")


def asks(*words: str) -> Script:
    """Messages to a dog, one after the other."""
    return Script(DOG, [CERTIFICATES, *(f"{ASK} {word}" for word in words)])


COURIER = "from courier import Arm, Courier\n"
HERE = "c = Courier('http://127.0.0.1:1448')\n"
ROUND = COURIER + HERE + "print(c.deliver([(0.6, 0.0), (0.6, 0.4)]), c.battery() > 50)\n"
LOW = COURIER + HERE + "c.ask('GET', '/api/core/no/such/thing')\n"
ARM = (
    COURIER + "a = Arm('127.0.0.1')\nprint(a.say('chassis move x 0.3 wait_for_complete true'), a.say('robot mode ?'))\n"
)
BOTH = (
    COURIER
    + "c, a = Courier('http://127.0.0.1:1448'), Arm('127.0.0.1')\nc.go(0.5, 0)\nprint(a.say('robot battery ?'))\n"
)
APP = "PYTHONPATH=examples/ci"
TALK = "version;robot mode free;gimbal moveto p 10 y 20;led control comp all r 255 g 0 b 0;gimbal attitude ?;"
PROGRESS = r"(?s)  % Total.*?(?=\{|\[|$)"  # curl's
# Up to its video, which is not recorded.
DOG_CLIENT = block("clients.md", "CyberDogClient(", "python").partition("    async with dog.video")[0]
PHOTO = f".venv/bin/roboglot cyberdog photo door.jpg --app-port {APP_PORT}"
SCRIPTS = {
    "start-rest": Script(
        REST, lines_of("start.md", "MoveToAction", "/dev/tcp", "certs"), needs="curl", random=PROGRESS
    ),
    "start-text": Script(TEXT, [line for line in lines_of("start.md", "MoveToAction") if "/dev/tcp" in line]).later,
    "start-program": Script(
        FRAMES,
        [".venv/bin/roboglot program run my_program.py"],
        {"my_program.py": block("start.md", "go_straight", "python")},
    ),
    **{
        f"first-{door}-{tool}": first(door, tool).later
        for door in (REST, TEXT, DOG)
        for tool in ("sh", "python", "js", "go")
    },
    f"first-{DOG}-sh": first(DOG, "sh"),
    "first-visual-sh": first(FRAMES, "sh").later,
    "first-visual-python": first(FRAMES, "python").later,
    "first-visual-js": first(FRAMES, "js").later,
    "rest-page": Script(
        REST, lines_of("protocols/slamware.md", "action-factories"), needs="curl", body="hermes", random=PROGRESS
    ).later,
    "rest-client": Script(REST, code=block("clients.md", "SlamwareClient(", "python")).later,
    "text-page": Script(
        TEXT, [next(blocks(DOCS / "protocols/robomaster.md", "")).splitlines()[0][2:]], body="robomaster_ep"
    ).later,
    "text-client": Script(TEXT, code=block("clients.md", "RoboMasterClient(", "python"), printed=6),
    "text-gimbal": Script(
        TEXT,
        [f"bash -c \"exec 3<>/dev/tcp/127.0.0.1/40923\nprintf 'command;{TALK}' >&3; timeout 5 cat <&3\""],
        body="robomaster_ep",
    ).later,
    "dog-goes": asks("10001", "6004 '{\"type\": 7}'", '6004 \'{"type": 1, "goalX": 0.6, "goalY": 0.1}\'').later,
    "dog-answers": asks("1012 '{\"volume\": 30}'", "5006", "99999").later,
    "dog-client": Script(
        DOG,
        [CERTIFICATES],
        code=DOG_CLIENT.partition("    async with dog.video")[0],
        random=r"\(at=[\d.]+",
        two_lines=True,
    ).later,
    "dog-photo": Script(DOG, [PHOTO, "sha256sum door.jpg"], body="cyberdog2").later,
    "dog-program": Script(
        DOG,
        [CERTIFICATES, f"{PYTHON} block_program.py"],
        {"block_program.py": (ROOT / "examples/block_program.py").read_text()},
        random=r"task_\d{16}",
    ).later,
    "courier": Script(REST, [f"{PYTHON} examples/ci/courier.py http://127.0.0.1:1448 0.6 0.2"]).later,
    "courier-round": Script(REST, [f"{APP} {PYTHON} round.py"], {"round.py": ROUND}).later,
    "courier-refused": Script(REST, [f"{APP} {PYTHON} low.py"], {"low.py": LOW}, random=r"line \d+|/\S+").later,
    "courier-arm": Script(TEXT, [f"{APP} {PYTHON} arm.py"], {"arm.py": ARM}).later,
    "courier-both": Script(TEXT, [f"{APP} {PYTHON} both.py"], {"both.py": BOTH}).later,
    **{
        f"program-{name}": program(name).later
        for name in (
            "battery_watch",
            "measure_room",
            "compass",
            "dance",
            "dice",
            "explorer",
            "light_show",
            "own_steps",
            "patrol",
            "polygon",
        )
    },
    "program-list": Script(
        FRAMES,
        [
            f".venv/bin/roboglot program {line}"
            for line in ("save hello.py", "list", "run hello.py", "log hello", "delete hello", "log hello; test $? = 1")
        ],
        {"hello.py": "cyberdog.task.block('one')\nprint('hello')\n"},
        body="cyberdog2",
        random=r"\d+:\d+:\d+|\d{4}-\S+",
    ).later,
    "program-wrong": Script(
        FRAMES,
        [".venv/bin/roboglot program run wrong.py; test $? = 1"],
        {"wrong.py": "print('before')\n[][1]\n"},
        body="cyberdog2",
    ).later,
}


async def play(script: Script, user: Terminal) -> list[tuple[int, str]]:
    """Exit status and output of each line, in the robot's address's and the port's stead what the script has."""
    for name, text in script.files.items():
        called, own = f"127.0.0.1:{APP_PORT}", f"127.0.0.1:{user.app_port}"
        here = user.address.join(text.replace(called, "{called}").split("127.0.0.1"))
        (user.folder / name).write_text(here.replace("{called}", own))
    ended = []
    for line in script.lines:
        found = await user.type(line.replace(f"--app-port {APP_PORT}", f"--app-port {user.app_port}"))
        ended.append((found.status, found.said))
    if script.code:
        printed = await user.run(script.code, lines=script.printed)
        ended.append((0, "\n".join(map(str, printed[: script.printed or None]))))
    return ended
