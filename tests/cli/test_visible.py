"""Texts of others on a terminal."""

from __future__ import annotations

import logging
import sys
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot import cli
from roboglot.access.trail import Entry
from roboglot.cli import audit
from roboglot.hosting.escaping import VisibleFormatter, visible, xml_text
from roboglot.recording.comparing import reports
from roboglot.recording.comparing.comparison import Comparison, Difference, Row


def test_controls_are_written_out_and_words_stay() -> None:
    assert visible("狗\t\x1b[2Ja\r\x9b1m\u202eb\n") == "狗\t\\x1b[2Ja\\x0d\\x9b1m\\u202eb\n"
    assert visible("\ud800") == "?"


@given(st.text())
def test_nothing_that_drives_a_terminal_is_left(text: str) -> None:
    assert all(character in "\t\n" or character.isprintable() or ord(character) > 0x9F for character in visible(text))


def test_log_lines_are_bounded() -> None:
    """Clients' names, and errors that quote them, may have megabytes."""
    try:
        raise ValueError("y" * 1_000_000)
    except ValueError:
        caught = sys.exc_info()
    record = logging.LogRecord("x", logging.INFO, "x.py", 1, "no file %r", ("z" * 1_000_000,), caught)
    text = VisibleFormatter("%(message)s  (%(name)s)").format(record)
    line, *traceback = text.split("\n")
    assert line.startswith("no file 'zzz")
    assert line.endswith("zzz … (1000010 characters)  (x)")
    assert traceback[-1].endswith("yyy")
    assert len(text) < 25_000


HOSTILE = "x\x1b]0;mine\x07\n9 a row of its own\x9b2J"


def test_rows_of_commands_are_visible_lines(capsys: pytest.CaptureFixture[str]) -> None:
    """Names that clients, robots and files bring go through these."""
    entry = Entry(0.0, "anna", "10.0.0.7:5", "a", HOSTILE, HOSTILE, "refused", HOSTILE)
    differences = [Difference(HOSTILE, HOSTILE, HOSTILE)]
    row = Row(HOSTILE, HOSTILE, 1, 1, 1, 0, differences)
    printed = [audit._line(1, entry), *reports.table(Comparison([row])).split("\n")]
    assert len(printed) == 5
    assert cli._printed(SystemExit(HOSTILE)) == 1
    assert all(line.isprintable() for line in [*printed, *capsys.readouterr().err.split("\n")])


def test_log_lines_are_visible_too() -> None:
    record = logging.LogRecord("x", logging.INFO, "", 0, "%s said: %s", ("a", "\x1b]0;mine\x07"), None)
    assert VisibleFormatter("%(message)s").format(record) == "a said: \\x1b]0;mine\\x07"


def test_system_errors_are_logged_without_numbers() -> None:
    wrapped = RuntimeError(str(ConnectionRefusedError(111, "Connection refused")))
    record = logging.LogRecord("x", logging.INFO, "", 0, "no broker: %s", (wrapped,), None)
    assert VisibleFormatter("%(message)s").format(record) == "no broker: Connection refused"


@given(st.text())
def test_any_text_fits_into_xml(text: str) -> None:
    element = ElementTree.Element("case", name=xml_text(text))
    read = ElementTree.fromstring(ElementTree.tostring(element, "utf-8"))
    assert read.get("name") is not None


def test_xml_keeps_words_and_pictures() -> None:
    assert xml_text("狗 🐕\tA\x00\ufffe\ud800") == "狗 🐕\tA\ufffd\ufffd\ufffd"
