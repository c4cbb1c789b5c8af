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
    from roboglot.storage.transactions import Transactions

CONNECTIONS_MAX = 200


def command(
    data: Annotated[Path, typer.Option(help="The SQLite file of accounts, favourites and records.")] = Path("cloud.db"),
    database: Annotated[
        str,
        typer.Option(envvar="ROBOGLOT_CLOUD_DATABASE", help="In place of the file: postgresql://user@host/database."),
    ] = "",
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

    try:
        opened = _open(data, database)
    except (OSError, ValueError, sqlite3.Error) as error:
        sys.exit(f"roboglot cloud: {'the database' if database else data} can't be used: {error}")
    store = CloudStore(opened)
    try:
        if account:
            print(asyncio.run(store.add_account(account)))
        else:
            _serve(store, address, port, verbose)
    except ValueError as error:
        sys.exit(f"roboglot cloud: {error}")
    finally:
        opened.close()


def _open(data: Path, url: str) -> Transactions:
    """PostgreSQL by its URL, else the file."""
    from roboglot.storage.database import Database

    if not url:
        return Database(data)
    if not url.startswith(("postgresql://", "postgres://")):
        raise ValueError("its URL begins with postgresql://")
    try:
        from roboglot.storage.postgresql import PostgreSQL
    except ImportError:
        raise OSError("PostgreSQL needs another package, which roboglot's extra `postgresql` brings") from None
    return PostgreSQL(url)


def _serve(store: CloudStore, address: str, port: int, verbose: bool) -> None:
    import uvicorn

    from roboglot.protocols.visual.back_end import BackEnd
    from roboglot.protocols.visual.back_end_connection import BackEndConnection

    uvicorn.run(
        BackEnd(store),
        http=BackEndConnection,
        ws="none",
        host=address,
        port=port,
        log_level="info" if verbose else "warning",
        lifespan="off",
        limit_concurrency=CONNECTIONS_MAX,
    )
