"""Requests of web pages: passed or refused by what a browser says, and by nothing that a page could forge."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.protocols.browsers import ORIGIN_MAX, Browsers, Headers, host_name, of_rows

RULE = Browsers("[slamware]", ("https://studio.example/",), ("robot.lan",))
NAMES = st.text("abcdefghijkl127.", min_size=1, max_size=9).map("a{}.example".format)


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1:1448", "127.1", "10.0.0.7", "[::1]:1448", "localhost", "a.localhost:80", "Robot.LAN.:1448", None],
)
def test_programs_pass_by_address_and_known_names(host: str | None) -> None:
    assert RULE.refusal(Headers(host=host)) == ""


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "", "a b", "x@127.0.0.1"]
)
def test_other_hosts_are_refused(host: str) -> None:
    assert "hosts" in RULE.refusal(Headers(host=host))


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("127.0.0.1:1448", "http://127.0.0.1:8000"),
        ("127.0.0.2:1448", "http://localhost:3000"),
        ("10.0.0.7:1448", "http://10.0.0.7"),
        ("10.0.0.7:1448", "https://studio.example"),
        ("[::1]:1448", "http://[::1]:5173"),
    ],
)
def test_pages_of_the_same_host_pass(host: str, origin: str) -> None:
    assert RULE.refusal(Headers(host=host, origin=origin)) == ""


@pytest.mark.parametrize(
    "origin",
    [
        "null",
        "",
        "http://studio.example",
        "https://studio.example.evil.example",
        "http://10.0.0.8",
        "http://localhost",
        "http://127.0.0.1",
        "file://10.0.0.7",
        "http://[",
        "chrome-extension://abc",
        "http://" + "x" * ORIGIN_MAX,
    ],
)
def test_pages_of_others_are_refused(origin: str) -> None:
    assert RULE.refusal(Headers(host="10.0.0.7:1448", origin=origin))


@given(NAMES, NAMES)
def test_no_name_of_strangers_passes(host: str, page: str) -> None:
    assert RULE.refusal(Headers(host=host))
    assert RULE.refusal(Headers(host="127.0.0.1", origin=f"http://{page}"))


def test_pages_of_another_robot_are_strangers() -> None:
    assert RULE.refusal(Headers(host="127.0.0.2:1448", origin="http://127.0.0.3"))


def test_pictures_of_strangers_pages_are_refused() -> None:
    hidden = Headers(host="127.0.0.1", site="cross-site")
    assert RULE.refusal(hidden)
    assert RULE.refusal(Headers(host="127.0.0.1", site="cross-site", referer="http://evil.example/page"))
    assert not RULE.refusal(Headers(host="127.0.0.1", site="cross-site", referer="http://localhost:3000/page"))


def test_a_link_of_another_page_opens_the_robots() -> None:
    rows = [
        (b"host", b"127.0.0.1"),
        (b"sec-fetch-site", b"cross-site"),
        (b"sec-fetch-mode", b"navigate"),
        (b"sec-fetch-dest", b"document"),
    ]
    assert not RULE.refusal(of_rows(rows, "GET"))
    assert RULE.refusal(of_rows(rows, "POST"))


def test_refusals_are_logged_once_as_warnings(caplog: pytest.LogCaptureFixture) -> None:
    rule = Browsers("[visual]")
    for _ in range(5):
        rule.refusal(Headers(host="127.0.0.1", origin="http://evil.example"))
    assert len(caplog.messages) == 1
    assert "[visual] origins" in caplog.text


@pytest.mark.parametrize("origin", ["studio.example", "https://studio.example/path", "http://a b", ""])
def test_invalid_origins_are_refused_by_name(origin: str) -> None:
    with pytest.raises(ValueError, match="is not an origin"):
        Browsers("[slamware]", (origin,))


@given(st.text(max_size=40))
def test_any_host_header_is_read_or_refused(text: str) -> None:
    name = host_name(text)
    assert name is None or name == name.lower()
