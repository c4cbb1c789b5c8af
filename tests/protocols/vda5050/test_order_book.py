"""Orders accepted and refused by chapter 6.1; the book stays consistent with any input."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from roboglot.protocols.vda5050.errors import Rejected
from roboglot.protocols.vda5050.order_book import ACTIONS_KEPT_MAX, ActionStatus, OrderBook
from roboglot.wire.vda5050.orders import ACTIONS_MAX, NODES_MAX, Action, Malformed, OrderMessage, read
from roboglot.wire.vda5050.versions import V2, V3, ErrorKind
from tests.protocols.vda5050.orders import action, encoded, order, valid_orders


def parsed(made: dict[str, Any]) -> OrderMessage:
    return read(encoded(made), OrderMessage)


def take(book: OrderBook, made: dict[str, Any], *, near: bool = True) -> bool:
    return book.take(parsed(made), lambda _: near)


def refusal(book: OrderBook, made: dict[str, Any], *, near: bool = True) -> ErrorKind:
    before = (book.order_id, book.update_id, list(book.nodes), list(book.edges))
    with pytest.raises(Rejected) as rejected:
        take(book, made, near=near)
    assert before == (book.order_id, book.update_id, book.nodes, book.edges)
    return rejected.value.kind


def finished(book: OrderBook) -> None:
    for _, node in list(book.base):
        book.pass_node(node)


def test_an_update_extends_the_base_where_it_ends() -> None:
    book = OrderBook()
    take(book, order("one", [(0, 0), (1, 0), (2, 0)], released=2))
    assert [node.released for node in book.nodes] == [True, True, False]
    take(book, order("one", [(1, 0), (2, 1), (3, 1)], update=1, first=1))
    assert [node.sequence_id for node in book.nodes] == [0, 2, 4, 6]
    assert [edge.sequence_id for edge in book.edges] == [1, 3, 5]
    assert all(node.released for node in book.nodes)


def test_refusals_follow_the_standard() -> None:
    book = OrderBook()
    assert refusal(book, order("one", [(9, 9)]), near=False) is ErrorKind.START_TOO_FAR
    take(book, order("one", [(0, 0), (1, 0)], update=3))
    assert refusal(book, order("two", [(0, 0)])) is ErrorKind.OTHER_ORDER
    assert refusal(book, order("one", [(0, 0), (1, 0)], update=2)) is ErrorKind.OUTDATED
    assert refusal(book, order("one", [(5, 0), (1, 0)], update=3)) is ErrorKind.SAME_UPDATE
    assert take(book, order("one", [(0, 0), (1, 0)], update=3)) is False  # sent again
    assert refusal(book, order("one", [(0, 0), (4, 0)], update=4)) is ErrorKind.NOT_A_CONTINUATION
    finished(book)
    take(book, order("one", [(1, 0), (2, 0)], update=4, first=1))
    book.drop_rest()
    assert refusal(book, order("one", [(2, 0), (3, 0)], update=5, first=2)) is ErrorKind.AFTER_CANCEL
    assert take(book, order("two", [(0, 0)]))


def test_an_order_with_a_horizon_is_not_finished() -> None:
    book = OrderBook()
    take(book, order("one", [(0, 0), (1, 0)], released=1))
    finished(book)
    assert not book.idle
    assert refusal(book, order("two", [(0, 0)])) is ErrorKind.OTHER_ORDER


def test_waiting_actions_fail_when_order_is_cancelled() -> None:
    book = OrderBook()
    made = order("one", [(0, 0), (1, 0)])
    made["nodes"][1]["actions"] = [action("waitForTrigger", "w")]
    take(book, made)
    book.drop_rest()
    assert book.idle
    assert book.actions["w"].status is ActionStatus.FAILED


def test_the_horizon_takes_its_actions_along() -> None:
    book = OrderBook()
    made = order("one", [(0, 0), (1, 0)], released=1)
    made["nodes"][1]["actions"] = [action("waitForTrigger", "w")]
    take(book, made)
    take(book, order("one", [(0, 0), (0, 2)], update=1))
    assert book.actions == {}


def test_updates_without_end_are_refused_at_the_limit() -> None:
    book, count = OrderBook(), NODES_MAX // 2
    take(book, order("one", [(x, 0) for x in range(count)]))
    take(book, order("one", [(count - 1 + x, 0) for x in range(count)], update=1, first=count - 1))
    assert len(book.nodes) == 2 * count - 1
    more = order("one", [(2 * count - 2 + x, 0) for x in range(3)], update=2, first=2 * count - 2)
    assert refusal(book, more) is ErrorKind.NOT_A_CONTINUATION
    finished(book)
    assert take(book, more)


def test_states_of_ended_actions_are_dropped_when_many() -> None:
    book = OrderBook()
    take(book, order("one", [(0, 0)]))
    for number in range(ACTIONS_KEPT_MAX // ACTIONS_MAX + 2):
        made = order("one", [(number, 0), (number + 1, 0)], update=number + 1, first=number)
        made["nodes"][1]["actions"] = [action("waitForTrigger", f"{number} {index}") for index in range(ACTIONS_MAX)]
        take(book, made)
        for state in book.actions.values():
            state.status = ActionStatus.FINISHED
    assert len(book.actions) == ACTIONS_KEPT_MAX
    assert f"{number} 0" in book.actions


def test_many_actions_are_compared_once_each() -> None:
    compared = 0

    class Id(str):
        __hash__ = str.__hash__

        def __eq__(self, other: object) -> bool:
            nonlocal compared
            compared += 1
            return str.__eq__(self, other)

    def made(update: int) -> OrderMessage:
        message = parsed(order("one", [(x, 0) for x in range(20)], update=update, released=1))
        known = message.nodes[-1]
        own = [Action("waitForTrigger", Id(f"{update} {number}")) for number in range(1000)]
        nodes = (*message.nodes[:-1], structs.replace(known, actions=tuple(own)))
        return structs.replace(message, nodes=nodes)

    book = OrderBook()
    for update in range(3):
        assert book.take(made(update), lambda _: True)
    assert len(book.actions) == 1000
    assert compared < 10_000


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda o: o["edges"].pop(), "need 1 edges"),
        (lambda o: o["nodes"][0].update(sequenceId=1), "even"),
        (lambda o: o["nodes"][1].update(sequenceId=6), "sequenceId 6"),
        (lambda o: o["edges"][0].update(endNodeId="x"), "names node x"),
        (lambda o: o["nodes"][0].update(released=False), "first"),
        (lambda o: o["nodes"][0].update(actions=[action("a", "1"), action("b", "1")]), "twice"),
        (lambda o: o["nodes"][0]["nodePosition"].update(x="far"), "x must be a number, not text"),
        (lambda o: o.pop("orderId"), "orderId"),
        (lambda o: o["nodes"].clear(), "nodes must have at least 1 entries"),
    ],
)
def test_malformed_orders_say_where(change: Any, words: str) -> None:
    made = order("one", [(0, 0), (1, 0)])
    change(made)
    with pytest.raises(Malformed, match=words):
        read(encoded(made), OrderMessage)


def test_both_versions_have_their_words() -> None:
    assert V3.error(ErrorKind.NO_ORDER) == "NO_ORDER_TO_CANCEL"
    assert V2.error(ErrorKind.NO_ORDER) == "noOrderToCancel"
    assert V2.error(ErrorKind.MALFORMED) == "validationError"


@settings(max_examples=50)
@given(valid_orders())
def test_any_valid_order_is_read(made: dict[str, Any]) -> None:
    assert parsed(made).order_id == made["orderId"]


@pytest.mark.slow  # ten thousand orders; the test above reads fewer
@pytest.mark.timeout(900)  # minutes on a slow machine
@settings(max_examples=10_000)
@given(valid_orders())
def test_ten_thousand_valid_orders_are_read(made: dict[str, Any]) -> None:
    assert len(parsed(made).nodes) == len(made["nodes"])


@settings(max_examples=50)
@given(
    st.binary(max_size=200)
    | st.recursive(st.none() | st.integers() | st.text(), st.lists).map(lambda v: json.dumps(v).encode())
)
def test_anything_else_is_malformed(data: bytes) -> None:
    with pytest.raises(Malformed):
        read(data, OrderMessage)


@settings(max_examples=50)
@given(st.lists(valid_orders() | st.just("reach") | st.just("cancel"), max_size=8))
def test_book_stays_consistent_after_any_steps(steps: list[Any]) -> None:
    book = OrderBook()
    for step in steps:
        if step == "reach" and (left := list(book.base)):
            book.pass_node(left[0][1])
        elif step == "cancel":
            book.drop_rest()
        elif isinstance(step, dict):
            try:
                take(book, step)
            except Rejected:
                continue
        numbers = [node.sequence_id for node in book.nodes]
        assert numbers == sorted(set(numbers))
        assert all(edge.sequence_id > numbers[0] - 2 for edge in book.edges) if numbers else not book.edges
        released = [node.released for node in book.nodes]
        assert released == sorted(released, reverse=True)
