"""The robot's camera in the console, in a real browser."""

from __future__ import annotations

import asyncio
from pathlib import Path

import av
import numpy as np
import pytest

from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.sound import SAMPLE_RATE, Sound
from roboglot.simulation.components.sensing.camera import SimulatedCamera
from tests.browser.served import PAGE_PATIENCE as PATIENCE
from tests.browser.served import OpenConsole, Page, Served
from tests.browser.served import until as until_page

pytestmark = pytest.mark.asyncio(loop_scope="session")
PITCH = 1000  # Hz
SHOWS_PICTURES = """() => document.querySelector('.screen video')?.videoWidth > 0
    || document.querySelector('.screen img')?.naturalWidth > 0"""


def heard_in(film: Path) -> bool:
    """Return whether a film has pictures, and somewhere the tone."""
    with av.open(str(film)) as file:
        assert next(file.decode(video=0)).width > 0
    with av.open(str(film)) as file:
        for frame in file.decode(audio=0):
            samples = frame.to_ndarray().reshape(-1).astype(float)
            spectrum = np.abs(np.fft.rfft(samples))
            loudest = np.fft.rfftfreq(len(samples), 1 / frame.sample_rate)[spectrum.argmax()]
            if samples.any() and abs(loudest - PITCH) < PITCH / 10:
                return True
    return False


async def pictures(served: Served, page: Page) -> None:
    """Let robot time pass until the page shows them."""
    async with asyncio.timeout(2 * PATIENCE / 1000):
        while not await page.evaluate(SHOWS_PICTURES):
            await served.clock.advance(0.1)
            await asyncio.sleep(0.05)


async def test_the_camera_shows_pictures(
    served: Served, open_console: OpenConsole, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    with monkeypatch.context() as patch:
        patch.setattr(SimulatedCamera, "delay", "the kernels are being compiled")
        patch.setattr(SimulatedCamera, "capture", asyncio.Event().wait)
        await page.click("text=Show the camera")
        await page.wait_for_selector(".screen >> text=the kernels are being compiled")
    await page.wait_for_selector(".screen >> text=Waiting for the first picture")
    await page.click("text=Close the camera")
    await page.click("text=Show the camera")
    await pictures(served, page)
    await page.wait_for_selector(".screen .why", state="detached")
    await page.click("text=Close the camera")
    await page.wait_for_selector(".screen", state="detached")


@pytest.mark.slow  # films with sound; in short: test_the_camera_shows_pictures
async def test_camera_shows_pictures_and_what_is_in_them(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    await page.click("#tab-drive")
    wave = 8000 * np.sin(2 * np.pi * PITCH / SAMPLE_RATE * np.arange(60 * SAMPLE_RATE))
    served.robot[Speaker].play(Sound("tone", wave.astype(np.int16)))
    await page.click("text=Show the camera")
    await pictures(served, page)
    async with asyncio.timeout(2 * PATIENCE / 1000):
        while not await page.locator("text=Sound").count():
            await served.clock.advance(0.1)
            await asyncio.sleep(0.05)
    await page.click("text=Sound")  # by a call or by motion JPEG: browsers make no calls over loopback alone
    await until_page(page, "!document.querySelector('.screen video, .screen audio').muted")
    async with asyncio.timeout(2 * PATIENCE / 1000):
        await page.click("text=Film")
        while not await page.evaluate("document.querySelector('.film').dataset.filmed > 60_000"):
            await served.clock.advance(0.1)
            await asyncio.sleep(0.05)
    async with page.expect_download() as saved:
        await page.click("text=End the film")
    film = await (await saved.value).path()
    assert await asyncio.to_thread(heard_in, film)
    await page.click("text=Close the camera")
    await page.wait_for_selector(".screen", state="detached")
