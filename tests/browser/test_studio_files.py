"""Files of the studio: examples and the guide's programs open as text, unchanged; others and the app's as blocks."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest

from tests.browser.served import Page, shows, until
from tests.browser.test_studio import COUNTING, Open, loaded, studio
from tests.programs.language.test_language_guide import shown

__all__ = ["studio"]  # the fixture
pytestmark = pytest.mark.asyncio(loop_scope="session")
EXAMPLES = Path(__file__).parents[2] / "examples" / "programs"
FILE = {"name": "f.py", "mimeType": "text/x-python"}
TIMES = "n => studio.editor.workspace.getBlockById('loop').getInputTargetBlock('TIMES').setFieldValue(n, 'NUM')"
FADE = "import('/base.js').then(base => { base.notice.value = { text: '', bad: false }; })"  # it stands for 8 s


@pytest.mark.slow  # long; test_program_of_blocks_comes_back_from_its_file is near
async def test_examples_and_guides_programs_open_as_text_unchanged(studio: Open) -> None:
    page = await studio()
    files = await asyncio.to_thread(lambda: {path.name: path.read_text("utf-8") for path in EXAMPLES.glob("*.py")})
    guide = {f"guide{n}.py": text for n, (kind, text, _) in enumerate(shown("language.md")) if kind == "python"}
    assert len(files) >= 20
    assert len(guide) >= 10
    for name, text in (files | guide).items():
        await page.click("text=Programs")
        await page.set_input_files("input[type=file]", {**FILE, "name": name, "buffer": text.encode()})
        await until(page, f"studio.program.value.name === {name[:-3]!r} && !document.querySelector('dialog')")
        assert await page.evaluate("studio.program.value.kind") == "text"
        await until(page, "document.querySelector('.notice').innerText !== ''")  # it says so
        await shows(page, "JSON.parse(localStorage['studio.program.' + studio.program.value.id] ?? '{}').body", text)
    assert page.errors == []


async def test_program_of_blocks_comes_back_from_its_file(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    await until(page, "studio.editor.code.value.includes('print')")
    for wanted in ("For the app (style)", "Program"):
        await comes_back(page, wanted)
    assert page.errors == []


async def test_program_changed_elsewhere_is_not_overwritten(studio: Open) -> None:
    page, other = await loaded(await studio(), COUNTING), await studio()
    for one in (page, other):  # until then the server answers nothing about programs
        await shows(one, "import('/studio/link.js').then(link => Boolean(link.opened.value))", True)
    own = await page.evaluate("studio.program.value.id")

    async def has(name: str, times: int) -> None:
        asking = f"link.ask({{ type: 'fetch', program: '{name}', log: false }})"
        found = f"import('/studio/link.js').then(link => {asking}).then(({{ program }}) => program?.body ?? '')"
        await shows(page, f"{found}.then(body => body.includes('range({times})'))", True)

    await has(own, 3)
    await other.evaluate(f"import('/studio/program.js').then(p => p.openStored('{own}'))")
    for times in (4, 5):  # one's own changes
        await other.evaluate(TIMES, times)
        await has(own, times)
    assert await other.evaluate("studio.program.value.id") == own
    await page.evaluate(TIMES, 9)
    await page.wait_for_selector(r".notice >> text=/Yours goes on as “My program( \d+)? \(my copy\)”; theirs is under/")
    copy = await page.evaluate("studio.program.value.id")
    await has(copy, 9)
    await has(own, 5)
    await page.evaluate(TIMES, 10)  # in its own place
    await has(copy, 10)
    assert await page.evaluate("studio.program.value.id") == copy != own
    assert page.errors == other.errors == []


async def test_going_back_to_a_version_loses_nothing(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    times = "studio.editor.workspace.getBlockById('loop').getInputTargetBlock('TIMES').setFieldValue(5, 'NUM')"
    kept = "JSON.parse(localStorage['studio.versions.' + studio.program.value.id] ?? '[]').length"
    await until(page, f"{kept} === 1")
    await page.evaluate(times)
    await until(page, "studio.editor.code.value.includes('range(5)')")
    await page.click("text=Programs")
    await page.click("dialog >> text=Compare")
    await shows(
        page, "document.querySelector('.changes').innerText", "− for count in range(3):\n+ for count in range(5):"
    )
    await page.locator("dialog li", has_text="Compare").get_by_role("button", name="Open").click()
    await until(page, "studio.editor.code.value.includes('range(3)')")
    await until(page, f"{kept} === 2")
    await page.click("text=Programs")
    await page.locator("dialog li", has_text="Compare").first.get_by_role("button", name="Open").click()
    await until(page, "studio.editor.code.value.includes('range(5)')")
    assert page.errors == []


async def comes_back(page: Page, wanted: str) -> None:
    """Save the program by the button ``wanted``, and open its file, and its frame."""
    code, state = await page.evaluate("[studio.editor.code.value, JSON.stringify(studio.editor.save())]")
    await page.click("text=Programs")
    async with page.expect_download() as saved:
        await page.get_by_role("button", name=wanted, exact=True).click()
    text = await asyncio.to_thread(Path(await (await saved.value).path()).read_text, "utf-8")
    assert "blocks" in text
    await page.set_input_files("input[type=file]", {"name": "g.json", "mimeType": "", "buffer": text.encode()})
    await until(page, "!document.querySelector('dialog')")
    await shows(page, "[studio.editor.code.value, JSON.stringify(studio.editor.save())]", [code, state])
    assert await page.evaluate("studio.program.value.kind") == "blocks"
    style = json.dumps(json.loads(state))  # as frames carry it: as text in a field
    frame = json.dumps({"describe": f"from a frame: {wanted}", "style": style, "body": code}).encode()
    await page.click("text=Programs")
    await page.set_input_files("input[type=file]", {"name": "h.json", "mimeType": "", "buffer": frame})
    await until(page, f"studio.program.value.name === 'from a frame: {wanted}'")
    await shows(page, "[studio.editor.code.value, JSON.stringify(studio.editor.save())]", [code, state])


@pytest.mark.slow  # long; test_program_of_blocks_comes_back_from_its_file is near
async def test_files_without_a_program_are_refused(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    before = await page.evaluate("[studio.program.value.id, studio.editor.code.value]")
    for name, held, why in (
        ("a.py", b"#" * 262_145, "it is too large"),
        ("b.json", b" " * 4_000_001, "it is too large"),
        ("c.json", json.dumps({"blocks": {"blocks": [{"type": "forever"}] * 6001}}).encode(), "it is too large"),
        ("d.json", b"null", "it is not a program"),
        ("e.json", b'{"style": "{"}', "it is not a program"),
        ("f.json", b"[1, 2", "it is not a program"),
        ("g.txt", b"\x89PNG\x00\x00", "it is not a program"),
    ):
        await page.click("text=Programs")
        await page.evaluate(FADE)
        await until(page, "!document.querySelector('dialog .notice')?.textContent")
        await page.set_input_files("input[type=file]", {"name": name, "mimeType": "", "buffer": held})
        await until(page, f"document.querySelector('dialog .notice')?.textContent.includes({why!r})")
        assert await page.evaluate("[studio.program.value.id, studio.editor.code.value]") == before, name
        await page.keyboard.press("Escape")
        await until(page, "!document.querySelector('dialog')")
    assert page.errors == []


async def test_opened_program_is_no_change(studio: Open) -> None:
    page = await loaded(await studio(), COUNTING)
    await shows(page, "document.querySelector('.stored').textContent", "Kept on the robot")
    changes = await page.evaluate("studio.editor.changes.value")
    id = await page.evaluate("studio.program.value.id")
    saved = f"JSON.parse(localStorage['studio.program.{id}']).saved"
    before = await page.evaluate(saved)
    await page.evaluate("import('/studio/program.js').then(p => p.fresh())")
    await page.evaluate(f"import('/studio/program.js').then(p => p.openStored('{id}'))")
    await until(page, "studio.editor.workspace.getBlockById('say')")
    await page.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(() => setTimeout(done))))")
    assert await page.evaluate("studio.editor.changes.value") == changes
    await page.evaluate("studio.editor.workspace.getBlockById('more').dispose(true)")
    await until(page, f"studio.editor.changes.value === {changes + 1}")
    await page.click("[aria-label=Undo]")
    await until(page, f"studio.editor.changes.value === {changes + 2}")
    assert await page.evaluate(saved) > before
    assert page.errors == []


async def test_programs_without_names_differ_in_the_list(studio: Open) -> None:
    """Pupils name few programs, and those of a robot are in one list."""
    page = await studio()
    named = "p.list().then((all) => all.find(({ id }) => id === studio.program.value.id).describe)"
    found = []
    for _ in range(2):
        await page.evaluate("import('/studio/program.js').then((p) => p.fresh())")
        await loaded(page, COUNTING)
        await page.evaluate("import('/studio/program.js').then((p) => p.keepNow())")
        found.append(await page.evaluate(f"import('/studio/program.js').then((p) => {named})"))
        await shows(page, "document.querySelector('.name input').placeholder", found[-1])
    assert len(set(found)) == 2
    assert all(name.startswith("My program") for name in found)
    assert page.errors == []
