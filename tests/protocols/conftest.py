"""One robot in lockstep with a client at every door."""

from __future__ import annotations

import subprocess
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from roboglot.testing.addresses import free_port
from tests.protocols.cyberdog.phone import Messages
from tests.protocols.every_door import PATIENCE, Doors
from tests.protocols.life import ADDRESS, Life
from tests.protocols.lockstep import lockstep_runtime
from tests.protocols.vda5050.conftest import ADDRESS as BROKER
from tests.protocols.vda5050.conftest import MOSQUITTO, Control, listening


@pytest.fixture
def control(tmp_path: Path) -> Iterator[tuple[int, Control]]:
    """A broker of our own: its port, and a fleet control there."""
    if MOSQUITTO is None:
        pytest.skip("needs mosquitto: apt-get install mosquitto")
    port, file = free_port(), tmp_path / "conf"
    file.write_text(f"listener {port} {BROKER}\nallow_anonymous true\n")
    broker = subprocess.Popen([MOSQUITTO, "-c", str(file)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    listening(port)
    control = Control(port, "v3")
    yield port, control
    control.close()
    broker.terminate()
    broker.wait()


@pytest.fixture
async def doors(
    request: pytest.FixtureRequest, tmp_path: Path, control: tuple[int, Control], monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[Doors]:
    """A robot in lockstep with a client at every door; the mark ``world`` names its world."""
    marked = request.node.get_closest_marker("world")
    monkeypatch.setattr("roboglot.agents.console.SECONDS", PATIENCE)
    port, fleet = control
    door = {"broker": f"{BROKER}:{port}", "serials": {"a": "a"}, "visualization_period": 0.2}
    names = "slamware", "robomaster", "cyberdog", "visual", "vda5050"
    robots = [{"name": "a", "body": "universal", "address": ADDRESS}]
    console = {"enabled": True, "port": 0}
    more = {"robots": robots, "vda5050": door, "console": console, "world": marked.args[0] if marked else "empty"}
    runtime = await lockstep_runtime(tmp_path / "data", ADDRESS, *names, **more)
    assert runtime.console is not None
    await runtime.console.ready()
    made = Doors(Life(runtime, tmp_path / "data", Messages(tmp_path)), fleet, runtime.console.address)
    await made.until(lambda: fleet.heard.get("visualization"))
    yield made
    await made.close()
