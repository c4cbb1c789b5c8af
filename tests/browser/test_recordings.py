"""Recordings on pages: made, found again, fetched and deleted."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.recording.reader import read_recording
from tests.browser.served import OpenConsole, Served

pytestmark = pytest.mark.asyncio(loop_scope="session")


@pytest.mark.slow  # a view of its own; tests/recording has the recorder
async def test_a_recording_is_begun_marked_and_ended(served: Served, open_console: OpenConsole) -> None:
    page = await open_console()
    page.on("dialog", lambda dialog: asyncio.ensure_future(dialog.accept("it bumped")))
    await page.click("#tab-actions")
    await page.click("button:has-text('Record')")
    await page.wait_for_selector("header >> text=REC")
    async with page.expect_response("**/api/recording"):
        await page.click("button:has-text('Mark')")
    await page.click("main a:has-text('Recordings')")
    await page.wait_for_selector("main li >> text=being recorded")
    assert "MB" not in await page.inner_text("main li")  # the card above says what is written
    await served.clock.advance(1.0)
    await page.click("text=End the recording")
    await page.wait_for_selector("text=is under")
    (file,) = (served.runtime.config.data / "recordings").glob("*.mcap")
    assert read_recording(file).topics["/marks"] == 1

    row = page.locator(f"li:has-text('{file.name}')")
    await row.locator("text=1.0 s · ").wait_for()
    async with page.expect_download() as loading:
        await row.locator("text=Download").click()
    loaded = await (await loading.value).path()
    assert await asyncio.to_thread(loaded.read_bytes) == await asyncio.to_thread(file.read_bytes)
    await row.locator("text=Play back").click()
    await row.locator(f"text=recording:{file}").wait_for()
    await row.locator("text=Remove").click()  # the question is answered above
    await page.wait_for_selector("text=Nothing has been recorded yet.")
    assert not file.exists()
