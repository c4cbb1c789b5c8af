"""``/metrics``: figures of robots and their doors, in Prometheus's text format.

Requests are counted from the first scrape on; before, the tap costs nothing. Labels come from robots, doors and
contracts, never from clients' data. All names are listed in docs/operation/metrics.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from prometheus_client import CollectorRegistry, Counter, Histogram, disable_created_metrics, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, InfoMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from prometheus_client.registry import Collector

from roboglot.console.desk import Desk
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.system.link import Link, LinkState, was_heard
from roboglot.model.events import ActionChanged
from roboglot.model.robot import Robot
from roboglot.model.tap import Direction, Exchange

STATUSES_MAX = 64  # distinct outcomes counted per door
SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0)
NONE, OTHER = "none", "other"  # an operation outside the contract; an outcome beyond STATUSES_MAX

disable_created_metrics()  # type: ignore[no-untyped-call]  # a second series for each, which no one reads


class Metrics:
    """Metrics of all robots of one desk."""

    content_type = CONTENT_TYPE_PLAIN_0_0_4.encode()

    def __init__(self, desk: Desk) -> None:
        self._statuses: dict[str, set[str]] = {}
        registry = self._registry = CollectorRegistry(auto_describe=True)
        by_operation = ("robot", "door", "operation")
        self._requests = Counter("roboglot_requests", "Requests understood.", by_operation, registry=registry)
        self._replies = Counter(
            "roboglot_replies", "Answers, by the protocol's own status.", (*by_operation, "status"), registry=registry
        )
        self._refusals = Counter("roboglot_refusals", "Requests that were not done.", by_operation, registry=registry)
        self._pushes = Counter("roboglot_pushes", "Messages sent by a door itself.", by_operation, registry=registry)
        self._bytes = Counter(
            "roboglot_payload_bytes", "Bytes of messages.", ("robot", "door", "direction"), registry=registry
        )
        self._latency = Histogram(
            "roboglot_reply_seconds",
            "Robot time from a request to its answer.",
            ("robot", "door"),
            buckets=SECONDS,
            registry=registry,
        )
        self._actions = Counter(
            "roboglot_actions_ended", "Actions that ended, by how.", ("robot", "action", "status"), registry=registry
        )
        registry.register(_Now(desk))
        self._leave = [leave for robot in desk.robots.values() for leave in self._follow(robot)]

    def text(self) -> bytes:
        """Return all values, in the text format 0.0.4."""
        return generate_latest(self._registry)

    def families(self) -> Iterator[Metric]:
        """Return all current values."""
        return iter(self._registry.collect())

    def close(self) -> None:
        """Stop counting."""
        for leave in self._leave:
            leave()
        self._leave.clear()

    def _follow(self, robot: Robot) -> Iterator[Callable[[], None]]:
        def ended(event: ActionChanged) -> None:
            if event.action.status.ended:
                self._actions.labels(robot.id, event.action.name, event.action.status.name.lower()).inc()

        yield robot.tap.listen(self._count)
        yield robot.events.listen(ActionChanged, ended)

    def _count(self, seen: Exchange) -> None:
        labels = (seen.robot, seen.door, seen.operation or NONE)
        self._bytes.labels(seen.robot, seen.door, seen.direction.value).inc(len(seen.payload))
        match seen.direction:
            case Direction.REQUEST:
                self._requests.labels(*labels).inc()
            case Direction.PUSH:
                self._pushes.labels(*labels).inc()
            case Direction.REPLY:
                self._replies.labels(*labels, self._status(seen)).inc()
                self._latency.labels(seen.robot, seen.door).observe(seen.seconds)
                if seen.refusal:
                    self._refusals.labels(*labels).inc()

    def _status(self, seen: Exchange) -> str:
        known = self._statuses.setdefault(seen.door, set())
        if seen.status not in known and len(known) >= STATUSES_MAX:
            return OTHER
        known.add(seen.status)
        return seen.status


class _Now(Collector):
    """Collector of current values at every scrape."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._last = (desk.world.clock.time(), time.perf_counter())
        self._factor = 1.0

    def describe(self) -> list[Metric]:
        return []

    def collect(self) -> Iterator[Metric]:
        world = self._desk.world
        yield InfoMetricFamily("roboglot", "This program.", {"version": world.version, "world": world.name})
        yield GaugeMetricFamily(
            "roboglot_real_time_factor", "Robot seconds per real second, since the last scrape.", self._pace()
        )
        yield CounterMetricFamily(
            "roboglot_behind_seconds", "Robot seconds lost by a machine that is too slow.", world.clock.behind
        )
        yield GaugeMetricFamily("roboglot_programs_running", "Block programs that run now.", self._desk.running())
        running = GaugeMetricFamily("roboglot_actions_running", "Actions under way.", labels=("robot",))
        battery = GaugeMetricFamily("roboglot_battery_ratio", "Charge of the battery, 0 to 1.", labels=("robot",))
        up = GaugeMetricFamily("roboglot_link_up", "1 if the real robot is connected.", labels=("robot", "address"))
        age = GaugeMetricFamily("roboglot_link_age_seconds", "Since the robot was last heard.", labels=("robot",))
        for name, robot in self._desk.robots.items():
            running.add_metric((name,), len(robot.actions.running()))
            if Battery in robot and was_heard(robot):
                battery.add_metric((name,), robot[Battery].state.percentage)
            if Link in robot:
                link = robot[Link]
                up.add_metric((name, link.address), link.state is LinkState.UP)
                age.add_metric((name,), link.age())
        yield from (running, battery, up, age)

    def _pace(self) -> float:
        """Return robot time over real time since the last scrape."""
        now = (self._desk.world.clock.time(), time.perf_counter())
        robot, real = now[0] - self._last[0], now[1] - self._last[1]
        if real > 0:
            self._factor, self._last = robot / real, now
        return self._factor
