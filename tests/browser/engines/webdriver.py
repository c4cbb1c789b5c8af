"""Firefox over WebDriver BiDi and WebKit over WebDriver, with the same few calls; each needs Debian's packages only.

These are the engines of Firefox and Safari. Playwright brings builds of its own, which are no packages.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import time
import urllib.request
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Protocol

from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect

STARTED = 60.0  # s until a browser answers
ANSWERED = 60.0  # s
LOOK = 0.1  # s between two looks at a page
MINI_BROWSER = next(Path("/usr/lib").glob("*/webkit2gtk-4.1/MiniBrowser"), None)
INSTALL = {
    "firefox": "apt-get install firefox-esr",
    "webkit": "apt-get install webkit2gtk-driver xvfb",
}
PREFERENCES = {
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "remote.active-protocols": 1,
    "toolkit.telemetry.enabled": False,
}


class Engine(Protocol):
    """A browser with one page."""

    def go(self, url: str) -> None:
        """Show a page."""

    def ask(self, body: str) -> Any:
        """Return what the body of an async function returns in the page."""

    def act(self, actions: list[dict[str, Any]]) -> None:
        """Have fingers and keys do something, as WebDriver's *perform actions* says it."""

    def close(self) -> None:
        """End the browser."""


def is_installed(name: str) -> bool:
    """Return whether the packages of a browser are there."""
    if name == "firefox":
        return shutil.which("firefox-esr") is not None
    return MINI_BROWSER is not None and None not in map(shutil.which, ("WebKitWebDriver", "Xvfb"))


def started(name: str, folder: Path) -> Engine:
    """Start a browser with a new profile in ``folder``."""
    return Firefox(folder) if name == "firefox" else WebKit(folder)


def until(engine: Engine, expression: str, patience: float = ANSWERED) -> None:
    """Wait until an expression holds in the page."""
    end = time.monotonic() + patience
    while not engine.ask(f"return Boolean({expression})"):
        assert time.monotonic() < end, (expression, engine.ask("return document.body.innerText"))
        time.sleep(LOOK)  # a page has no event of ours


def press(engine: Engine, *keys: str) -> None:
    """Press keys, one after the other; ``\\ue007`` and its like are WebDriver's names of those without a letter."""
    steps = [{"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]
    engine.act([{"type": "key", "id": "keys", "actions": steps}])


def hold(engine: Engine, selector: str, up: int = 0, finger: str = "mouse") -> None:
    """Put the mouse or a finger down on an element, and move it up by so many pixels."""
    x, y = engine.ask(
        f"const at = document.querySelector({json.dumps(selector)}); at.scrollIntoView({{ block: 'nearest' }});"
        "const box = at.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2].map(Math.round)"
    )
    steps = [{"type": "pointerMove", "x": x, "y": y}, {"type": "pointerDown", "button": 0}]
    if up:
        steps.append({"type": "pointerMove", "x": x, "y": y - up, "duration": 100})
    engine.act([{"type": "pointer", "id": finger, "parameters": {"pointerType": finger}, "actions": steps}])


def let_go(engine: Engine, finger: str = "mouse") -> None:
    """Take the mouse's button or the finger up again."""
    steps = [{"type": "pointerUp", "button": 0}]
    engine.act([{"type": "pointer", "id": finger, "parameters": {"pointerType": finger}, "actions": steps}])


def click(engine: Engine, selector: str) -> None:
    """Click on an element once it is there."""
    until(engine, f"document.querySelector({json.dumps(selector)})")
    hold(engine, selector)
    let_go(engine)


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def _run(command: list[str], **more: Any) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **more)


class Firefox:
    """Firefox ESR without a window."""

    def __init__(self, folder: Path) -> None:
        port, self._open = _free_port(), ExitStack()
        lines = (f"user_pref({json.dumps(key)}, {json.dumps(value)});\n" for key, value in PREFERENCES.items())
        (folder / "user.js").write_text("".join(lines), "utf-8")
        self._process = _run(
            ["firefox-esr", "--headless", "--profile", str(folder), "--remote-debugging-port", str(port), "about:blank"]
        )
        end = time.monotonic() + STARTED
        while True:
            try:
                opening = connect(f"ws://127.0.0.1:{port}/session", max_size=None, proxy=None)
                self._link = self._open.enter_context(opening)
                break
            except (OSError, InvalidHandshake):
                assert time.monotonic() < end
                time.sleep(LOOK)  # a browser that starts says nothing
        self._number = 0
        self._call("session.new", capabilities={})
        self._page = self._call("browsingContext.getTree")["contexts"][0]["context"]

    def _call(self, method: str, **params: object) -> Any:
        self._number += 1
        self._link.send(json.dumps({"id": self._number, "method": method, "params": params}))
        while (answer := json.loads(self._link.recv(timeout=ANSWERED))).get("id") != self._number:
            pass  # events
        assert answer["type"] == "success", answer
        return answer["result"]

    def go(self, url: str) -> None:
        self._call("browsingContext.navigate", context=self._page, url=url, wait="complete")

    def ask(self, body: str) -> Any:
        text = f"(async () => JSON.stringify(await (async () => {{ {body} }})() ?? null))()"
        found = self._call("script.evaluate", expression=text, target={"context": self._page}, awaitPromise=True)
        assert found["type"] == "success", found
        return json.loads(found["result"]["value"])

    def act(self, actions: list[dict[str, Any]]) -> None:
        self._call("input.performActions", context=self._page, actions=actions)

    def close(self) -> None:
        self._open.close()
        _end(self._process)


class WebKit:
    """WebKitGTK's own browser, on a virtual screen."""

    def __init__(self, folder: Path) -> None:
        port, self._said = _free_port(), os.pipe()
        self._screen = _run(
            ["Xvfb", "-displayfd", str(self._said[1]), "-screen", "0", "1300x900x24"], pass_fds=self._said
        )
        number = os.read(self._said[0], 16).decode().strip()
        own = {"DISPLAY": f":{number}", "HOME": str(folder), "LIBGL_ALWAYS_SOFTWARE": "1", "NO_AT_BRIDGE": "1"}
        alone = {"XDG_DATA_HOME": f"{folder}/data", "WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS": "1"}  # root has none
        self._process = _run(["WebKitWebDriver", f"--port={port}"], env={**os.environ, **own, **alone})
        self._base = f"http://127.0.0.1:{port}"
        end = time.monotonic() + STARTED
        while True:
            try:
                self._call("GET", "/status")
                break
            except OSError:
                assert time.monotonic() < end
                time.sleep(LOOK)  # a browser that starts says nothing
        browser = {"binary": str(MINI_BROWSER), "args": ["--automation"]}
        wish = {"capabilities": {"alwaysMatch": {"webkitgtk:browserOptions": browser}}}
        self._base += f"/session/{self._call('POST', '/session', wish)['sessionId']}"

    def _call(self, method: str, path: str, wish: object = None) -> Any:
        body = None if wish is None else json.dumps(wish).encode()
        request = urllib.request.Request(self._base + path, body, {"content-type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=ANSWERED) as answer:
            return json.loads(answer.read())["value"]

    def go(self, url: str) -> None:
        self._call("POST", "/url", {"url": url})

    def ask(self, body: str) -> Any:
        text = (
            f"const done = arguments[0]; (async () => {{ {body} }})()"
            ".then(value => done(JSON.stringify([value ?? null])), error => done(JSON.stringify(`${error}`)))"
        )
        found = json.loads(self._call("POST", "/execute/async", {"script": text, "args": []}))
        assert isinstance(found, list), found
        return found[0]

    def act(self, actions: list[dict[str, Any]]) -> None:
        self._call("POST", "/actions", {"actions": actions})

    def close(self) -> None:
        with suppress(OSError):
            self._call("DELETE", "")
        _end(self._process)
        _end(self._screen)
        for end in self._said:
            os.close(end)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(20)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
