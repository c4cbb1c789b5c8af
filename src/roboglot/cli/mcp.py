"""``roboglot mcp``: robots as tools for agents, over standard input or streamable HTTP."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path
from typing import Annotated

import typer

from roboglot.hosting.error_text import in_words
from roboglot.text_files import named_text_of

HOST = "127.0.0.1"


def command(
    console: Annotated[
        str, typer.Option(envvar="ROBOGLOT_CONSOLE", help="The console of a running `roboglot up`.")
    ] = "http://127.0.0.1:50080",
    http: Annotated[
        int | None,
        typer.Option(min=1, max=65535, help="Serve streamable HTTP on this port of 127.0.0.1, path /mcp; else stdio."),
    ] = None,
    token_file: Annotated[Path | None, typer.Option(help="A file with the token; else ROBOGLOT_TOKEN.")] = None,
) -> None:
    """Offer the robots of a console as tools to an agent, over MCP, until it disconnects."""
    try:
        token = named_text_of(token_file) if token_file else os.environ.get("ROBOGLOT_TOKEN", "")
    except (OSError, ValueError) as error:
        raise typer.BadParameter(in_words(error)) from None
    if http is not None:
        _refuse_taken(http)
    from roboglot.agents.console import ConsoleClient
    from roboglot.agents.server import make_server

    server = make_server(ConsoleClient(console, token.strip()))
    if http is None:
        server.run("stdio")
    else:
        server.run("streamable-http", host=HOST, port=http)


def _refuse_taken(port: int) -> None:
    """End the program with a sentence if another one has the port: the server would log lines of its own."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            sys.exit(f"roboglot mcp: port {port} of {HOST}: {error.strerror}; choose another one with --http")
