"""Secrets at the tap: recordings keep and the console shows what passes it, but no passwords."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.clock import LockstepClock
from roboglot.model.tap import Exchange, Tap, without_secrets


@given(st.text(min_size=1), st.sampled_from(["password", "wifi_password", "Password", "delivery_admin_password"]))
def test_passwords_are_left_out_and_all_else_stays(secret: str, key: str) -> None:
    values = {"ssid": "plant", key: secret, "options": [1, 2.5, None]}
    for data in (json.dumps(values), json.dumps(values, ensure_ascii=False)):
        assert json.loads(without_secrets(data.encode("utf-8", "surrogatepass"))) == {**values, key: "***"}


@pytest.mark.parametrize(
    "data",
    [
        b'{"password": 12345678, "x": 1}',
        b'{"password": "12345678',
        json.dumps({"params": json.dumps({"password": "12345678"})}).encode(),
        json.dumps({"a": {"admin_password": {"enable": True, "password": "12345678"}}}).encode(),
    ],
)
def test_no_form_lets_them_through(data: bytes) -> None:
    clock = LockstepClock()
    tap, seen = Tap("a", clock), list[Exchange]()
    tap.listen(seen.append)
    tap.request("slamware", "PUT /network", data)
    assert b"12345678" not in seen[0].payload
    assert b"***" in seen[0].payload
