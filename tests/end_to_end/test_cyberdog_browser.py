"""A real browser shows the robot's camera, moving, from the page in examples/."""

from __future__ import annotations

import asyncio
import http.client
import importlib.util
import shutil
import socket
from pathlib import Path
from typing import Any

import pytest

from roboglot.clients.cyberdog import Certificates, CyberDogClient
from roboglot.testing.addresses import free_addresses, free_port
from roboglot.testing.process import served
from roboglot.wire.cyberdog.chapters.motion.motion import Motion

EXAMPLE = Path(__file__).parents[2] / "examples" / "cyberdog_video.py"
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
ADDRESS = free_addresses(1)
PATIENCE = 90.0  # s without a new picture
OPTIONS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--mute-audio",
    "--no-first-run",
    "--disable-dev-shm-usage",
]


def _example() -> Any:
    spec = importlib.util.spec_from_file_location("cyberdog_video", EXAMPLE)
    assert spec
    assert spec.loader
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    return example


@pytest.mark.parametrize(
    ("length", "body"), [(None, b"no json"), (None, b"[]"), (None, b"{}"), ("-1", b""), ("x", b"")]
)
async def test_the_page_refuses_what_is_no_offer(length: str | None, body: bytes) -> None:
    no_one: Any = None
    page = _example().serve(no_one, 0, [])

    def post() -> int:
        link = http.client.HTTPConnection("127.0.0.1", page.server_port, timeout=60)
        link.request("POST", "/offer", body, {"Content-Length": length} if length else {})
        with link.getresponse() as answer:
            link.close()
            return answer.status

    try:
        assert await asyncio.to_thread(post) == 400
    finally:
        await asyncio.to_thread(page.shutdown)
        page.server_close()


@pytest.mark.skipif(
    all(name == "lo" for _, name in socket.if_nameindex()),
    reason="Chromium makes no calls where there is only loopback",
)
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine (Debian: apt-get install chromium)")
@pytest.mark.slow  # starts Chromium and waits for WebRTC; tests/protocols/cyberdog/images has the video
async def test_a_browser_shows_moving_pictures(tmp_path: Path) -> None:
    example = _example()
    seen: list[Any] = []
    port = free_port()
    arguments = ("--robot", "a=cyberdog2", "--world", "playground", "--app", f"127.0.0.1:{port}")
    with served(tmp_path / "data", *arguments, address=ADDRESS) as robot:
        certificates = Certificates.load(robot.data / "cyberdog" / "tls")
        async with CyberDogClient(ADDRESS, certificates, app_port=port) as dog:
            await dog.found()
            await dog.stand()
            page = example.serve(dog, 0, seen)
            profile = f"--user-data-dir={tmp_path / 'profile'}"
            command = [str(CHROMIUM), *OPTIONS, profile, f"http://127.0.0.1:{page.server_port}/"]
            quiet = asyncio.subprocess.DEVNULL
            browser = await asyncio.create_subprocess_exec(*command, stdout=quiet, stderr=quiet)
            try:
                async with asyncio.timeout(PATIENCE) as limit, dog.servo(Motion.TROT_SLOW) as joystick:
                    joystick.set(0.0, 0.0, 0.5)
                    frames = 0
                    while not (seen and seen[-1]["frames"] > 60 and seen[-1]["moved"] > 2):
                        await asyncio.sleep(0.2)
                        if seen and seen[-1]["frames"] > frames:  # a busy machine shows less than one a second
                            frames = seen[-1]["frames"]
                            limit.reschedule(asyncio.get_running_loop().time() + PATIENCE)
            except TimeoutError:
                pytest.fail(f"no more pictures for {PATIENCE} s; the page's last word: {seen[-1:]}")
            finally:
                browser.terminate()
                await browser.wait()
                page.shutdown()
                page.server_close()
    assert (seen[-1]["width"], seen[-1]["height"]) == (1280, 720)
