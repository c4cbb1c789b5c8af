"""``roboglot certs``: the certificates that CyberDog clients need."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from roboglot.config import load_config
from roboglot.hosting.error_text import in_words
from roboglot.protocols.cyberdog.certificates import ensure_certificates, export_client


def command(
    export: Annotated[Path, typer.Option(help="Folder for ca-cert.pem, client-cert.pem and client-key.pem.")],
    data: Annotated[Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="The robot's data folder.")] = None,
) -> None:
    """Write the certificates and key with which a client connects to the robot's gRPC door over mutual TLS."""
    folder = load_config(None, {"data": str(data) if data else None}).data / "cyberdog"
    try:
        ensure_certificates(folder)
        written = export_client(folder, export)
        (export / ".gitignore").write_text("*\n")  # private keys do not belong in a repository
    except OSError as error:  # BadCertificates, too
        sys.exit(f"roboglot certs: {in_words(error)}")
    for path in written:
        print(path)
