"""``roboglot cloud``: the reference back end for block programs, and its accounts."""

from __future__ import annotations

import asyncio
import sqlite3
import sys
from pathlib import Path
from typing import Annotated

import typer

from roboglot.hosting.error_text import in_words
from roboglot.hosting.logs import set_up_logging


def command(
    data: Annotated[Path, typer.Option(help="The SQLite file of accounts, favourites and records.")] = Path("cloud.db"),
    database: Annotated[
        str,
        typer.Option(envvar="ROBOGLOT_CLOUD_DATABASE", help="postgresql://user@host/database, instead of the file."),
    ] = "",
    address: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0: any free one.")] = 8030,
    account: Annotated[
        str, typer.Option(help="Create this account, or renew its token; print the token and exit.")
    ] = "",
    host: Annotated[list[str] | None, typer.Option(help="A host name that clients use; repeat for more.")] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Listen outside loopback, where tokens pass without encryption.")
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log every request.")] = False,
) -> None:
    """Run a back end that records the events of robots and stores the favourite programs of accounts."""
    set_up_logging(verbose)
    from roboglot.storage.cloud import CloudStore
    from roboglot.storage.opening import open_database

    if not account:
        _warn_if_open(address, insecure)
    try:
        opened = open_database(data, database)
    except (OSError, ValueError, sqlite3.Error) as error:
        sys.exit(f"roboglot cloud: {'the database' if database else data} can't be used: {in_words(error)}")
    store = CloudStore(opened)
    try:
        if account:
            print(asyncio.run(store.add_account(account)))
        else:
            from roboglot.cloud.serving import serve

            serve(store, address, port, host or [], _print_address, verbose=verbose)
    except ValueError as error:
        sys.exit(f"roboglot cloud: {error}")
    finally:
        opened.close()


def _print_address(url: str) -> None:
    print(f"listening on {url}", flush=True)


def _warn_if_open(address: str, insecure: bool) -> None:
    """End the program for an address outside loopback without ``insecure``; with it, print a warning in red."""
    from rich.console import Console

    from roboglot.config import is_loopback

    if is_loopback(address):
        return
    if not insecure:
        sys.exit(
            f"roboglot cloud: on {address} tokens would pass without encryption. Let it listen on 127.0.0.1 behind a"
            " proxy with TLS, or give --insecure if that is what you want"
        )
    Console(stderr=True, highlight=False, soft_wrap=True).print(
        f"[bold red]INSECURE[/][red]: anyone on the network of {address} can read the accounts' tokens and"
        " programs, and anyone with a token can change its account[/]"
    )
