"""Turns of tests at ports that only one program of a machine can have."""

import socket
from pathlib import Path

from tests.conftest import OTHER_TESTS, reason_to_wait


def test_no_turn_is_kept_while_strangers_hold_ports(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger, (tmp_path / "lock").open("w") as one:
        stranger.bind(("127.0.0.1", 0))
        port = stranger.getsockname()[1]
        with (tmp_path / "lock").open("w") as other:
            assert str(port) in reason_to_wait(one, [port])
            assert str(port) in reason_to_wait(other, [port]), "the first one has not kept the turn"
            stranger.close()
            assert reason_to_wait(one, [port]) == ""
            assert reason_to_wait(other, [port]) == OTHER_TESTS
        one.close()
        with (tmp_path / "lock").open("w") as later:
            assert reason_to_wait(later, [port]) == ""
