"""Signalling: what one end writes the other reads; what is none of it is refused and nothing else."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.cyberdog.chapters.camera import (
    DEFAULT_UID,
    Alignment,
    BadSignal,
    Candidate,
    Description,
    End,
    Failure,
    Screen,
    fields_of,
    read_signal,
)
from roboglot.wire.cyberdog.text import read_params

uids = st.text(min_size=1, max_size=128)
signals = st.one_of(
    st.builds(
        Description,
        uids,
        st.sampled_from(["offer", "answer"]),
        st.text(min_size=1).map("v=0\r\n".__add__),
        st.none() | st.builds(Screen, st.integers(600, 800), st.integers(600, 1200), st.sampled_from(Alignment)),
    ),
    st.builds(Candidate, uids, st.text(max_size=1024), st.none() | st.text(), st.none() | st.integers(0, 9)),
    st.builds(End, uids, st.booleans()),
    st.builds(Failure, uids, st.integers(), st.text()),
)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=8,
)
names = ["offer_sdp", "answer_sdp", "c_sdp", "uid", "height", "width", "alignment", "error", "is_closed"]


@given(signals)
def test_written_signals_are_read_back(signal) -> None:
    assert read_signal(json.loads(json.dumps(fields_of(signal)))) == signal


@given(st.dictionaries(st.sampled_from(names), json_values))
def test_anything_else_is_a_bad_signal_or_one(fields) -> None:
    try:
        signal = read_signal(fields)
    except BadSignal:
        return
    assert isinstance(signal, Description | Candidate | End | Failure)


def test_a_description_may_be_text() -> None:
    wanted = Description("default_uid", "offer", "v=0\r\n")
    assert read_signal({"offer_sdp": "v=0\r\n"}) == wanted
    assert read_signal({"offer_sdp": json.dumps({"type": "offer", "sdp": "v=0\r\n"})}) == wanted
    with pytest.raises(BadSignal):
        read_signal({"offer_sdp": "{"})


@pytest.mark.parametrize("end", ["\r\n", "\n"])
def test_line_ends_as_they_are_in_nested_texts(end: str) -> None:
    sdp = f"v=0{end}o=- 1 1 IN IP4 0.0.0.0{end}"
    nested = f'{{"type": "offer", "sdp": "{sdp}"}}'  # assembled by hand, as one app does
    assert read_signal({"offer_sdp": nested}) == Description(DEFAULT_UID, "offer", sdp)
    assert read_signal(read_params(f'{{"offer_sdp": {{"type": "offer", "sdp": "{sdp}"}}}}')) == Description(
        DEFAULT_UID, "offer", sdp
    )
    with pytest.raises(BadSignal):
        read_signal({"offer_sdp": f'{{"sdp": {end}'})
