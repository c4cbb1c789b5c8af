"""Frames from front ends: what is accepted, and which number the first bad field gets."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.replies import feedback, responses
from roboglot.wire.visual.requests import FRAME_MAX, BadFrame, FrameSubject, Request, parse_request

SAVE: dict[str, Any] = {
    "type": "task",
    "id": "123",
    "target_id": ["678"],
    "operate": "save",
    "mode": "single",
    "condition": "now",
    "body": "cyberdog.stand_up()",
}


def test_manual_s_save_frame_has_raw_line_breaks() -> None:
    text = (
        '{"type": "task", "id": "123", "target_id": ["678"], "operate": "save", "mode": "single",\n'
        ' "condition": "now", "body": "\ncyberdog.stand_up()\ntime.sleep(60)\n"}'
    )
    assert parse_request(text) == Request(
        FrameSubject.TASK, "123", "save", ("678",), "", "", "single", "now", "\ncyberdog.stand_up()\ntime.sleep(60)\n"
    )


def test_unused_fields_from_an_app_are_empty_strings() -> None:
    empty = dict.fromkeys(("describe", "style", "mode", "condition", "body"), "")
    request = parse_request(
        json.dumps({"type": "task", "id": "1", "target_id": ["a", "b", "a"], "operate": "suspend"} | empty)
    )
    assert request == Request(FrameSubject.TASK, "1", "suspend", ("a", "b"))


def test_inquiry_of_everything_and_of_ai_without_operation() -> None:
    assert parse_request('{"type": "task", "id": "x", "target_id": [], "operate": "inquiry"}').targets == ()
    assert parse_request('{"type": "AI", "id": "x", "target_id": [], "mode": "face"}').operate == "inquiry"
    assert (
        parse_request(
            json.dumps(SAVE | {"type": "module", "operate": "add", "mode": "common", "condition": "f()"})
        ).operate
        == "save"
    )


@pytest.mark.parametrize(
    ("change", "state"),
    [
        ({"type": "tasks"}, FeedbackState.BAD_TYPE),
        ({"type": None}, FeedbackState.BAD_TYPE),
        ({"type": "x", "id": 5}, FeedbackState.BAD_TYPE),  # the first bad field decides
        ({"id": ""}, FeedbackState.BAD_ID),
        ({"id": 5}, FeedbackState.BAD_ID),
        ({"id": "x" * 129}, FeedbackState.BAD_ID),
        ({"operate": ""}, FeedbackState.BAD_OPERATE),
        ({"operate": ["678"]}, FeedbackState.BAD_OPERATE),
        ({"operate": "add"}, FeedbackState.BAD_OPERATE),
        ({"target_id": []}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": "678"}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["../x"]}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["x\n"]}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["x", 3]}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["x" * 129]}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["厨房"]}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["debug"]}, FeedbackState.BAD_TARGET_ID),
        ({"target_id": ["x"] * 1001}, FeedbackState.BAD_TARGET_ID),
        ({"describe": 'a"""b'}, FeedbackState.BAD_DESCRIBE),
        ({"describe": 1}, FeedbackState.BAD_DESCRIBE),
        ({"describe": "\ud800"}, FeedbackState.BAD_DESCRIBE),
        ({"style": {}}, FeedbackState.BAD_STYLE),
        ({"mode": "common"}, FeedbackState.BAD_MODE),
        ({"mode": ""}, FeedbackState.BAD_MODE),
        ({"condition": ""}, FeedbackState.BAD_CONDITION),
        ({"condition": "* * * * *"}, FeedbackState.BAD_CONDITION),
        ({"body": " "}, FeedbackState.BAD_BODY),
        ({"body": None}, FeedbackState.BAD_BODY),
        ({"body": "x" * 300_000}, FeedbackState.BAD_BODY),
        ({"body": "a\0b"}, FeedbackState.BAD_BODY),
        ({"operate": "debug"}, FeedbackState.BAD_TARGET_ID),
        ({"operate": "debug", "target_id": ["debug"], "mode": "cycle"}, FeedbackState.BAD_MODE),
        ({"operate": "debug", "target_id": ["debug"], "condition": "21:30"}, FeedbackState.BAD_CONDITION),
        ({"operate": "run", "mode": "cycle", "condition": ""}, FeedbackState.BAD_CONDITION),
        ({"operate": "run", "mode": "always"}, FeedbackState.BAD_MODE),
        ({"type": "SLAM", "operate": "inquiry", "mode": ""}, FeedbackState.BAD_MODE),
    ],
)
def test_the_first_bad_field_decides(change: dict[str, Any], state: FeedbackState) -> None:
    with pytest.raises(BadFrame) as refusal:
        parse_request(json.dumps(SAVE | change))
    assert refusal.value.state is state


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", "NaN", '{"a": NaN}', "[" * 100_000, "1" * 5000, '{"a":1,}', " " * (FRAME_MAX + 1)]
)
def test_invalid_json_is_refused(text: str) -> None:
    with pytest.raises(BadFrame) as refusal:
        parse_request(text)
    assert refusal.value.state is FeedbackState.NOT_JSON


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "line 1, column 1: Expecting value"),
        ("[" * 1_000_000, "it is nested too deeply"),
        ('{"id": ' + "9" * 5000 + "}", "a number is too long"),
        ('{"id": NaN}', "NaN is not JSON"),
    ],
)
def test_invalid_json_is_refused_in_plain_words(text: str, why: str) -> None:
    with pytest.raises(BadFrame) as refusal:
        parse_request(text)
    assert str(refusal.value) == f"not JSON: {why}"


def test_a_refusal_says_whose_frame_it_was() -> None:
    with pytest.raises(BadFrame) as refusal:
        parse_request(json.dumps(SAVE | {"body": 3}))
    bad = refusal.value
    assert (bad.kind, bad.id, bad.operate, bad.target) == ("task", "123", "save", "678")
    with pytest.raises(BadFrame) as refusal:
        parse_request('{"type": 1, "id": ["x"], "target_id": {}}')
    assert (refusal.value.kind, refusal.value.id, refusal.value.target) == ("", "", "")


# Hypothesis builds its tables at the first draw, which takes seconds on a busy machine.
FUZZ = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


@FUZZ
@given(st.dictionaries(st.sampled_from([*SAVE, "describe", "style", "odd"]), anything))
def test_no_object_breaks_the_parser(change: dict[str, Any]) -> None:
    try:
        request = parse_request(json.dumps(SAVE | change))
    except BadFrame as error:
        refusal: BadFrame | None = error
    else:
        refusal = None
        assert request.operate == "save" or not request.body
    if refusal is not None:
        assert 1 <= refusal.state <= 10
        refusal.target.encode()


@FUZZ
@given(st.text())
def test_no_text_breaks_the_parser(text: str) -> None:
    with pytest.raises(BadFrame):
        parse_request(text)


def test_replies_are_the_manuals() -> None:
    progress = feedback(
        kind="task", id="2123", target="678", operate="run", state=0, describe="run task", block=("begin", '块`\\"~')
    )
    assert json.loads(progress) == {
        "feedback": {
            "type": "task",
            "id": "2123",
            "target_id": "678",
            "operate": "run",
            "state": 0,
            "describe": "run task",
        },
        "block": {"type": "begin", "id": '块`\\"~'},
    }
    assert "block" not in json.loads(
        feedback(kind="task", id="1", target="", operate="run", state=1, describe="x" * 9999)
    )
    (answer,) = responses(kind="task", id="1", items=[])
    assert json.loads(answer) == {"response": {"type": "task", "id": "1", "list": []}}
