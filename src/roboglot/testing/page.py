"""The last exchanges of a failed test as one HTML page, with its picture."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape

from roboglot.model.tap import Exchange

SHOWN_MAX = 500  # exchanges
TEXT_MAX = 4000  # characters per exchange
STYLE = """:root{color-scheme:light dark}body{font:14px/1.4 system-ui,sans-serif;margin:2em 1em;max-width:80em}
pre{white-space:pre-wrap;overflow-wrap:anywhere;margin:0}table{border-collapse:collapse;width:100%}
td,th{border-top:1px solid #8888;padding:4px 8px;text-align:left;vertical-align:top}
td:nth-child(-n+4){white-space:nowrap}.refused{background:#f003}.push{opacity:.7}
img{max-width:100%;border:1px solid #8888}"""
COLUMNS = ("robot time", "robot", "door", "", "operation", "message", "status")


def page(title: str, failure: str, exchanges: Iterable[Exchange], picture: bytes | None) -> str:
    """Return the page; messages are escaped, so that they show as text only."""
    shown = list(exchanges)[-SHOWN_MAX:]
    image = f'<img alt="map" src="data:image/png;base64,{base64.b64encode(picture).decode()}">' if picture else ""
    head = "".join(f"<th>{name}</th>" for name in COLUMNS)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
        '<meta name="viewport" content="width=device-width">'
        f"<h1>{escape(title)}</h1><pre>{escape(failure)}</pre>{image}"
        f"<h2>The last {len(shown)} exchanges</h2><table><tr>{head}</tr>{''.join(map(_row, shown))}</table></html>\n"
    )


def _row(exchange: Exchange) -> str:
    text = exchange.payload.decode("utf-8", "backslashreplace")
    if len(text) > TEXT_MAX:
        text = f"{text[:TEXT_MAX]} … ({len(exchange.payload)} bytes)"
    kind = "refused" if exchange.refusal else str(exchange.direction)
    status = f"{exchange.status} {exchange.refusal}".strip()
    cells = (
        f"{exchange.stamp:.3f}",
        exchange.robot,
        exchange.door,
        {"request": "→", "reply": "←", "push": "⇠"}[exchange.direction],
        exchange.operation,
    )
    plain = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
    return f'<tr class="{kind}">{plain}<td><pre>{escape(text)}</pre></td><td>{escape(status)}</td></tr>'
