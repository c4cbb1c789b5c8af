"""Metrics pushed to a collector by OTLP over HTTP, as protobuf: the same values as in ``/metrics``.

Chapter "OTLP/HTTP" of https://opentelemetry.io/docs/specs/otlp/. The messages are those of opentelemetry-proto.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable
from importlib.metadata import version
from urllib.request import Request, urlopen

from opentelemetry.proto.collector.metrics.v1.metrics_service_pb2 import ExportMetricsServiceRequest
from opentelemetry.proto.common.v1.common_pb2 import AnyValue, KeyValue
from opentelemetry.proto.metrics.v1.metrics_pb2 import (
    AGGREGATION_TEMPORALITY_CUMULATIVE,
    HistogramDataPoint,
    Metric,
    NumberDataPoint,
)
from prometheus_client.core import Metric as Family
from prometheus_client.samples import Sample

from roboglot.console.metrics import Metrics
from roboglot.transport.log_limiter import LogLimiter

log = logging.getLogger(__name__)
SECONDS = 5.0  # s for the collector's answer


class Pusher:
    """Sends all values of ``metrics`` to the collector at ``endpoint`` every ``period`` s."""

    def __init__(self, metrics: Metrics, endpoint: str, period: float) -> None:
        self._metrics, self._period = metrics, period
        self._url = f"{endpoint.rstrip('/')}/v1/metrics"
        self._began = time.time_ns()
        self._log_limiter = LogLimiter(log)

    async def run(self) -> None:
        """Push until cancelled; failures of the collector are logged now and then."""
        while True:
            await asyncio.sleep(self._period)
            data = encode(self._metrics.families(), self._began, time.time_ns())
            try:
                await asyncio.to_thread(self._post, data)
            except OSError as error:
                self._log_limiter.warning("push", "collector %s took no metrics: %s", self._url, error)

    def _post(self, data: bytes) -> None:
        request = Request(self._url, data, {"content-type": "application/x-protobuf"}, method="POST")
        with urlopen(request, timeout=SECONDS) as reply:
            reply.read(1 << 16)


def encode(families: Iterable[Family], began: int, now: int) -> bytes:
    """Return an ExportMetricsServiceRequest; ``began`` and ``now`` are ns since 1970."""
    request = ExportMetricsServiceRequest()
    resource = request.resource_metrics.add()
    resource.resource.attributes.append(_attribute("service.name", "roboglot"))
    resource.resource.attributes.append(_attribute("service.version", version("roboglot")))
    scope = resource.scope_metrics.add()
    scope.scope.name = "roboglot.console"
    for family in families:
        metric = scope.metrics.add(name=family.name, description=family.documentation, unit=family.unit)
        _fill(metric, family, began, now)
    return bytes(request.SerializeToString())


def _fill(metric: Metric, family: Family, began: int, now: int) -> None:
    match family.type:
        case "histogram":
            metric.histogram.aggregation_temporality = AGGREGATION_TEMPORALITY_CUMULATIVE
            metric.histogram.data_points.extend(_histograms(family.samples, began, now))
        case "counter":
            metric.sum.aggregation_temporality = AGGREGATION_TEMPORALITY_CUMULATIVE
            metric.sum.is_monotonic = True
            metric.sum.data_points.extend(_number(sample, began, now) for sample in family.samples)
        case _:
            metric.gauge.data_points.extend(_number(sample, 0, now) for sample in family.samples)


def _attribute(key: str, value: str) -> KeyValue:
    return KeyValue(key=key, value=AnyValue(string_value=value))


def _attributes(sample: Sample) -> list[KeyValue]:
    return [_attribute(key, value) for key, value in sample.labels.items() if key != "le"]


def _number(sample: Sample, began: int, now: int) -> NumberDataPoint:
    return NumberDataPoint(
        attributes=_attributes(sample), start_time_unix_nano=began, time_unix_nano=now, as_double=sample.value
    )


def _histograms(samples: Iterable[Sample], began: int, now: int) -> list[HistogramDataPoint]:
    """Return a point for each set of labels; Prometheus's buckets are cumulative, OTLP's are not."""
    points: dict[tuple[tuple[str, str], ...], HistogramDataPoint] = {}
    below: dict[tuple[tuple[str, str], ...], float] = {}
    for sample in samples:
        key = tuple(sorted((name, value) for name, value in sample.labels.items() if name != "le"))
        if key not in points:
            points[key] = HistogramDataPoint(
                attributes=_attributes(sample), start_time_unix_nano=began, time_unix_nano=now
            )
        point = points[key]
        if sample.name.endswith("_bucket"):
            if (limit := sample.labels["le"]) != "+Inf":
                point.explicit_bounds.append(float(limit))
            point.bucket_counts.append(int(sample.value - below.get(key, 0.0)))
            below[key] = sample.value
        elif sample.name.endswith("_count"):
            point.count = int(sample.value)
        elif sample.name.endswith("_sum"):
            point.sum = sample.value
    return list(points.values())
