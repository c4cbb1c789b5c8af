"""Clients of a busy program get equal parts of it; one that asks for more waits, and the log names it."""

from __future__ import annotations

import logging

import pytest

from roboglot.model.inputs.fairness import (
    CLIENTS_MAX,
    COST_MAX,
    HANDSHAKE_GAP,
    LENT,
    LOG_SECONDS,
    PART,
    WINDOW,
    Fairness,
)

GREEDY, MODEST = "10.0.0.7:4001", "10.0.0.8:4002"


class Machine:
    """Time that passes when the test says so, and a loop that answers requests one after another."""

    def __init__(self) -> None:
        self.time = self.worked = 100.0
        self.held = 0.0  # part of a request's time in which other programs have the processor
        self.fairness = Fairness(lambda: self.time, lambda: self.worked)

    def ask(self, peer: str, seconds: float) -> float:
        """Answer a request that takes ``seconds``; return how long it waited before."""
        share = self.fairness.of(peer)
        waited = 0.0
        while wait := self.fairness.wait(share):
            waited += wait
            self.time += wait
        self.time += seconds
        self.worked += (1.0 - self.held) * seconds
        self.fairness.took(share, seconds)
        return waited


@pytest.fixture
def machine() -> Machine:
    return Machine()


def test_one_alone_never_waits(machine: Machine) -> None:
    assert not any(machine.ask(GREEDY, 0.01) for _ in range(100))


def test_greedy_client_waits_and_modest_does_not(machine: Machine, caplog: pytest.LogCaptureFixture) -> None:
    began, used = machine.time, 0.0
    with caplog.at_level(logging.WARNING):
        while machine.time < began + 2.0:
            assert machine.ask(MODEST, 0.001) == 0.0
            for _ in range(20):
                machine.ask(GREEDY, 0.004)
                used += 0.004
    assert used / (machine.time - began) <= PART + 0.05
    (line,) = caplog.messages
    assert line == f"client {GREEDY} waits for others: it asks for more than its share of 2 connections"


def test_log_names_it_again_after_a_while(machine: Machine, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            machine.ask(MODEST, 0.001)
            for _ in range(10):
                machine.ask(GREEDY, 0.02)
            machine.time += LOG_SECONDS
    assert len(caplog.messages) == 2


def test_many_connections_gain_a_host_nothing(machine: Machine) -> None:
    machine.ask("10.0.0.8:1", 0.001)
    waited = [machine.ask(f"10.0.0.7:{port}", 0.01) for port in range(5000, 5030)]
    assert sum(wait > 0 for wait in waited) >= 3
    assert machine.ask("10.0.0.8:1", 0.001) == 0.0


def test_connections_of_one_host_share_with_each_other(machine: Machine) -> None:
    waits = {"one": 0.0, "other": 0.0}
    for _ in range(20):
        waits["other"] += machine.ask("127.0.0.1:2", 0.001)
        waits["one"] += sum(machine.ask("127.0.0.1:1", 0.01) for _ in range(6))
    assert waits["one"] > 10 * WINDOW * (1 - PART) / 2
    assert waits["other"] == 0.0


def test_no_client_waits_where_there_is_time(machine: Machine) -> None:
    for _ in range(100):
        assert machine.ask(GREEDY, PART * WINDOW / 5) == 0.0
        assert machine.ask(MODEST, 0.001) == 0.0
        machine.time += WINDOW / 3


def test_no_client_waits_while_others_hold_the_processor(machine: Machine) -> None:
    machine.held = 0.8
    for _ in range(30):
        assert machine.ask(MODEST, 0.001) == 0.0
        assert machine.ask(GREEDY, 0.02) == 0.0


def test_long_request_counts_little(machine: Machine) -> None:
    machine.ask(MODEST, 0.001)
    machine.ask(GREEDY, 100 * COST_MAX)
    assert machine.fairness.of(GREEDY).used == COST_MAX


def test_stagehakes_of_many_robots_follow_each_other(machine: Machine) -> None:
    assert machine.fairness.wait_to_dial() == 0.0
    waits = [machine.fairness.wait_to_dial() for _ in range(99)]
    assert waits == pytest.approx([HANDSHAKE_GAP * number for number in range(1, 100)])
    machine.time += 100 * HANDSHAKE_GAP
    assert machine.fairness.wait_to_dial() == 0.0


def test_memory_is_bounded(machine: Machine) -> None:
    for number in range(3 * CLIENTS_MAX):
        machine.ask(f"10.{number >> 8}.0.{number & 255}:1", 0.0)
    assert len(machine.fairness._uses) <= CLIENTS_MAX
    assert len(machine.fairness._hosts) <= CLIENTS_MAX


def test_lent_requests_are_counted_afterwards(machine: Machine) -> None:
    use = machine.fairness.of(GREEDY)
    machine.fairness.wait(use)
    machine.fairness.lend(use, 0.0001)
    use.left -= 10
    machine.fairness.lend(use, 0.0002)  # this one, and ten that took no longer than the one before
    assert use.used == pytest.approx(0.0001 + 0.0002 + 10 * 0.0001)
    assert use.left == LENT


def test_window_takes_back_what_it_lent(machine: Machine) -> None:
    use = machine.fairness.of(MODEST)
    machine.fairness.wait(use)
    machine.fairness.lend(use, 0.0001)
    use.left -= 3
    machine.time += WINDOW
    machine.ask(GREEDY, 0.001)
    assert (use.left, use.owed) == (0, 3)
    assert use.last == pytest.approx(machine.time - 0.001), "it asked in that window"


def test_first_request_of_a_window_is_timed(machine: Machine) -> None:
    use = machine.fairness.of(MODEST)
    assert machine.fairness.timed(use, lambda: "answer") == "answer"
    assert use.left == LENT
    use.settle()
    assert machine.fairness.timed(use, lambda: None) is None, "nothing was done"
    assert use.left == 0


def test_greedy_client_is_not_answered_at_once(machine: Machine) -> None:
    machine.ask(MODEST, 0.001)
    for _ in range(3):
        machine.ask(GREEDY, 0.02)
    assert machine.fairness.timed(machine.fairness.of(GREEDY), lambda: 1 / 0) is None
    assert machine.fairness.timed(machine.fairness.of(MODEST), lambda: "answer") == "answer"
