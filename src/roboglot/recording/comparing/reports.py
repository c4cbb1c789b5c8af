"""Reports of a comparison for people and build servers: a table, an HTML page, JUnit XML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from xml.etree import ElementTree

from roboglot.hosting.escaping import in_line, xml_text
from roboglot.recording.comparing.comparison import Comparison, Row

STYLE = (
    ":root{color-scheme:light dark}body{font:15px sans-serif;margin:2em auto;padding:0 1em;max-width:70em}"
    "table{border-collapse:collapse;width:100%}.bad{background:#f003}td{overflow-wrap:anywhere}th:last-child{width:45%}"
    "td,th{border:1px solid #8888;padding:.3em .6em;text-align:left;vertical-align:top}"
)


def percent(share: float) -> str:
    """Return the share in percent; 100 only if nothing is missing."""
    return "100 %" if share == 1.0 else f"{min(share, 0.999) * 100:.1f} %"


def table(comparison: Comparison) -> str:
    """Return a line for each operation with its differences below, and the totals at the end."""
    lines = []
    for row in (*comparison.rows, *comparison.drive):
        operation = in_line(row.operation) or "(none)"
        lines.append(f"{percent(row.share):>8}  {row.ones:5} {row.others:5}  {in_line(row.door)} {operation}")
        lines += [in_line(f"{'':24}{d.what}: {d.one} | {d.other}") for d in row.differences[:5]]
    lines += [f"{in_line(door)}: {percent(comparison.of(door).fidelity)}" for door in comparison.doors]
    lines += [in_line(line) for line in _drive_lines(comparison)]
    lines.append(f"fidelity: {_total(comparison) or 'unknown, as nothing was compared'}")
    return "\n".join(lines)


def _total(comparison: Comparison) -> str:
    """Return how much agrees; empty if nothing was compared."""
    return "" if comparison.empty else percent(comparison.fidelity)


def _drive_lines(comparison: Comparison) -> list[str]:
    """Return what was compared besides messages, and what was not."""
    lines = []
    if comparison.drive:
        figures = f" ({comparison.figures})" if comparison.figures else ""
        lines.append(f"drive: {percent(comparison.driven)}{figures}")
    if comparison.reason:
        only = "messages and actions" if comparison.drive else "messages"
        lines.append(f"only {only} were compared, not where the robots were: {comparison.reason}")
    if not comparison.rows:
        lines.append("no messages were compared: there are none")
    return lines


def page(comparison: Comparison, names: tuple[str, str]) -> str:
    """Return a self-contained HTML page."""
    total = _total(comparison)
    parts = [
        '<!doctype html><html lang="en"><meta charset=utf-8><title>roboglot compare</title>',
        '<meta name="viewport" content="width=device-width">',
        f"<style>{STYLE}</style><h1>{f'{total} agree' if total else 'Nothing was compared'}</h1>",
        f"<p>first: {escape(names[0])}<br>second: {escape(names[1])}</p>",
    ]
    if comparison.robot:
        parts.append(f"<p>robot {escape(comparison.robot)}</p>")
    parts += [f"<p class=bad>{escape(note)}</p>" for note in comparison.notes]
    if comparison.drive and comparison.doors:
        shares = percent(comparison.messages), percent(comparison.driven)
        parts.append(
            f"<p>{shares[0]} of the messages agree, and {shares[1]} of the drive; the smaller share counts.</p>"
        )
    for door in comparison.doors:
        of_door = comparison.of(door)
        parts += _html_table(f"{door}: {percent(of_door.fidelity)}", of_door.rows)
    if comparison.drive:
        parts += _html_table(f"drive: {percent(comparison.driven)}", comparison.drive)
    parts += [f"<p>{escape(line)}</p>" for line in _drive_lines(comparison)]
    return "\n".join(parts)


def _html_table(title: str, rows: Sequence[Row]) -> list[str]:
    head = "<table><tr><th>operation<th>first<th>second<th>agrees<th>what does not</tr>"
    return [f"<h2>{escape(title)}</h2>", head, *map(_html_row, rows), "</table>"]


def junit(comparison: Comparison) -> bytes:
    """Return one test case for each operation."""
    suites = ElementTree.Element("testsuites", name="roboglot compare")
    sections = {door: comparison.of(door).rows for door in comparison.doors}
    if comparison.drive:
        sections["drive"] = comparison.drive
    for door, rows in sections.items():
        failed = sum(row.agreed < row.checks for row in rows)
        suite = ElementTree.SubElement(suites, "testsuite", name=door, tests=str(len(rows)), failures=str(failed))
        for row in rows:
            case = ElementTree.SubElement(suite, "testcase", classname=door, name=xml_text(row.operation) or "(none)")
            if row.agreed < row.checks:
                text = "\n".join(f"{d.what}: {d.one} | {d.other}" for d in row.differences)
                why = f"{row.checks - row.agreed} of {row.checks} do not agree"
                ElementTree.SubElement(case, "failure", message=why).text = xml_text(text)
    if comparison.reason:
        suite = ElementTree.SubElement(suites, "testsuite", name="drive", tests="1", skipped="1")
        case = ElementTree.SubElement(suite, "testcase", classname="drive", name="places")
        ElementTree.SubElement(case, "skipped", message=xml_text(comparison.reason))
    return bytes(ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True))


def _html_row(row: Row) -> str:
    wrong = "".join(
        f"<div>{escape(d.what)}: <code>{escape(d.one)}</code> | <code>{escape(d.other)}</code></div>"
        for d in row.differences
    )
    bad = " class=bad" if row.differences else ""
    share = percent(row.share)
    return f"<tr{bad}><td>{escape(row.operation)}<td>{row.ones}<td>{row.others}<td>{share}<td>{wrong}</tr>"
