"""``roboglot cloud``: the reference back end for block programs, and its accounts."""

from __future__ import annotations

import asyncio
import sqlite3
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboglot.cli.screen import set_up_logging

if TYPE_CHECKING:
    from roboglot.storage.cloud import CloudStore

CONNECTIONS_MAX = 200


def command(
    data: Annotated[Path, typer.Option(help="The SQLite file of accounts, favourites and records.")] = Path("cloud.db"),
    address: Annotated[str, typer.Option(help="Where it listens.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any that is free.")] = 8030,
    account: Annotated[
        str, typer.Option(help="Open this account (or give it a new token), print the token, and end.")
    ] = "",
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log every request.")] = False,
) -> None:
    """A back end that robots tell what happens on them, and that has an account's favourite programs for them."""
    set_up_logging(verbose)
    from roboglot.storage.cloud import CloudStore
    from roboglot.storage.database import Database

    try:
        database = Database(data)
    except (OSError, ValueError, sqlite3.Error) as error:
        sys.exit(f"roboglot cloud: {data} can't be used: {error}")
    store = CloudStore(database)
    try:
        if account:
            print(asyncio.run(store.add_account(account)))
        else:
            _serve(store, address, port, verbose)
    except ValueError as error:
        sys.exit(f"roboglot cloud: {error}")
    finally:
        database.close()


def _serve(store: CloudStore, address: str, port: int, verbose: bool) -> None:
    import uvicorn

    from roboglot.protocols.visual.back_end import BackEnd

    uvicorn.run(
        BackEnd(store),
        host=address,
        port=port,
        log_level="info" if verbose else "warning",
        lifespan="off",
        limit_concurrency=CONNECTIONS_MAX,
    )
