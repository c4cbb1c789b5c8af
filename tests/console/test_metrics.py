"""Metrics as Prometheus reads them, by its own parser."""

import asyncio
import contextlib
import json
import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.request import Request, urlopen

import pytest
from opentelemetry.proto.collector.metrics.v1.metrics_service_pb2 import ExportMetricsServiceRequest
from prometheus_client.parser import text_string_to_metric_families

from roboglot.console.otlp import Pusher
from roboglot.model.components.energy.battery import Battery
from tests.console.conftest import ADDRESS, ServedConsole
from tests.narrowing import known

ROOT = Path(__file__).resolve().parents[2]


async def scraped(served: ServedConsole) -> dict[tuple[str, ...], float]:
    status, text = await served.ask("/metrics")
    assert status == 200
    return {
        (sample.name, *sorted(sample.labels.values())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


async def say(*commands: str) -> list[str]:
    reader, writer = await asyncio.open_connection(ADDRESS, 40923)
    answers = []
    for line in commands:
        writer.write(line.encode())
        answers.append((await reader.readuntil(b";")).decode())
    writer.close()
    return answers


async def test_nothing_is_counted_before_the_first_scrape(served: ServedConsole) -> None:
    assert not served.robot.tap.watched
    await scraped(served)
    assert served.robot.tap.watched
    assert served.runtime.console is not None
    await served.runtime.console.close()
    assert not served.robot.tap.watched


async def test_requests_answers_and_refusals_are_counted_by_operation(served: ServedConsole) -> None:
    await scraped(served)
    await say("command;", "robot battery ?;", "robot battery ?;", "chassis speed x 99;")
    seen = await scraped(served)
    key = ("a", "robomaster", "robot battery ?")
    assert seen["roboglot_requests_total", *key] == 2
    assert seen["roboglot_reply_seconds_count", "a", "robomaster"] >= 4
    refused = {name: value for name, value in seen.items() if name[0] == "roboglot_refusals_total"}
    assert list(refused.values()) == [1.0]


async def test_unknown_commands_become_no_labels(served: ServedConsole) -> None:
    await scraped(served)
    await say("command;", *(f"nonsense{number} now;" for number in range(20)))
    text = " ".join(map(str, await scraped(served)))
    assert "nonsense" not in text


async def test_the_state_of_robots_and_time(served: ServedConsole) -> None:
    first = await scraped(served)
    assert first["roboglot_battery_ratio", "a"] == served.robot[Battery].state.percentage
    assert first["roboglot_actions_running", "a"] == 0
    assert first["roboglot_programs_running",] == 0
    still = await scraped(served)
    assert still["roboglot_real_time_factor",] == 0  # in lockstep no robot time passed
    await served.clock.advance(1.0)
    assert (await scraped(served))["roboglot_real_time_factor",] > 0


async def test_metrics_are_only_read(served: ServedConsole) -> None:
    assert (await served.ask("/metrics", {}))[0] == 405

    def head() -> tuple[int, str, bytes]:
        with urlopen(Request(f"{served.url}/metrics", method="HEAD"), timeout=60) as reply:
            return reply.status, reply.headers["content-type"], reply.read()

    status, kind, body = await asyncio.to_thread(head)  # as `curl -I` asks
    assert (status, body) == (200, b"")
    assert kind.startswith("text/plain")


async def test_board_and_the_page_name_what_there_is(served: ServedConsole) -> None:
    await scraped(served)
    await say("command;", "robot battery ?;")
    names = {name for name, *_ in await scraped(served)}
    reported = {name.removesuffix("_total") for name in names} | {name.removesuffix("_bucket") for name in names}
    reported |= {
        f"roboglot_{which}" for which in ("refusals", "pushes", "actions_ended", "link_up", "link_age_seconds")
    }
    board = json.loads((ROOT / "deploy/grafana.json").read_text())
    asked = " ".join(target["expr"] for panel in board["panels"] for target in panel["targets"])
    for text in (asked, (ROOT / "docs/operation/metrics.md").read_text()):
        for name in re.findall(r"\broboglot_[a-z_]+", text):
            assert name.removesuffix("_total").removesuffix("_bucket") in reported, name


async def test_a_collector_gets_the_same_values(served: ServedConsole) -> None:
    await scraped(served)
    await say("command;", "robot battery ?;", "chassis speed x 99;")
    assert served.runtime.console is not None
    metrics = await known(known(served.runtime.console)._application).metrics()
    seen = await scraped(served)
    taken: list[tuple[str, str, bytes]] = []
    with collector(taken) as address:
        pushing = asyncio.create_task(Pusher(metrics, address, 0.01).run())
        while not taken:  # noqa: ASYNC110 - another thread fills it
            await asyncio.sleep(0.01)
        pushing.cancel()
    path, kind, body = taken[0]
    assert (path, kind) == ("/v1/metrics", "application/x-protobuf")
    (resource,) = ExportMetricsServiceRequest.FromString(body).resource_metrics
    assert ("service.name", "roboglot") in {(a.key, a.value.string_value) for a in resource.resource.attributes}
    pushed = {metric.name: metric for metric in resource.scope_metrics[0].metrics}
    counted = {
        tuple(sorted(a.value.string_value for a in point.attributes)): point.as_double
        for point in pushed["roboglot_requests"].sum.data_points
    }
    assert counted == {key[1:]: value for key, value in seen.items() if key[0] == "roboglot_requests_total"}
    assert pushed["roboglot_requests"].sum.is_monotonic
    (latency,) = pushed["roboglot_reply_seconds"].histogram.data_points
    assert latency.count == sum(latency.bucket_counts) == seen["roboglot_reply_seconds_count", "a", "robomaster"]
    assert len(latency.bucket_counts) == len(latency.explicit_bounds) + 1
    battery = served.robot[Battery].state.percentage
    assert pushed["roboglot_battery_ratio"].gauge.data_points[0].as_double == pytest.approx(battery, abs=0.01)
    known(known(known(served.runtime.console)._application)._metrics).close()


async def test_a_collector_that_is_not_there_is_logged(served: ServedConsole, caplog: pytest.LogCaptureFixture) -> None:
    metrics = await known(known(served.runtime.console)._application).metrics()
    pushing = asyncio.create_task(Pusher(metrics, f"http://{ADDRESS}:9", 0.01).run())
    while "took no metrics" not in caplog.text:  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    pushing.cancel()


@contextlib.contextmanager
def collector(taken: list[tuple[str, str, bytes]]) -> Iterator[str]:
    """Yield the address of an HTTP server that keeps what is posted: path, content type, body."""

    class Take(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            taken.append((self.path, self.headers["content-type"], body))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer((ADDRESS, 0), Take) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://{ADDRESS}:{server.server_address[1]}"
        server.shutdown()
        thread.join()
