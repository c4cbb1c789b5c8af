"""``roboglot cloud`` as people call it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import httpx

from roboglot.storage.cloud import CloudStore
from roboglot.storage.database import Database


def call(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "roboglot", "cloud", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)


async def test_account_is_opened_and_its_token_reported_once(tmp_path: Path) -> None:
    path = tmp_path / "cloud.db"
    ended = call("--data", str(path), "--account", "class 7b")
    assert ended.returncode == 0
    database = Database(path)
    store = CloudStore(database)
    assert await store.account_of(ended.stdout.strip()) == "class 7b"
    assert await store.account_of("something else") is None
    kept = database.run_now(lambda c: c.execute("SELECT * FROM cloud_account").fetchall())
    assert ended.stdout.strip() not in str(kept)
    database.close()


def test_address_is_printed_once_it_answers(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "roboglot", "cloud", "--data", str(tmp_path / "c.db"), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            line = server.stdout.readline()
            address = re.fullmatch(r"listening on (http://127\.0\.0\.1:\d+)\n", line)
            assert address is not None, line
            assert httpx.get(f"{address[1]}/nothing", timeout=60.0).status_code == 404
        finally:
            server.send_signal(signal.SIGINT)
        assert server.wait(60) == 0


def test_mistakes_are_reported_in_one_line(tmp_path: Path) -> None:
    for arguments, words in (
        (("--account", " "), "1 to 64"),
        (("--data", str(tmp_path)), "can't be used"),
        (("--database", "mysql://robots"), "begins with postgresql://"),
        (("--database", f"postgresql:///robots?host={tmp_path}"), "the database can't be used"),
    ):
        ended = call("--data", str(tmp_path / "c.db"), *arguments)
        assert ended.returncode == 1
        assert words in ended.stderr
        assert "Traceback" not in ended.stderr
