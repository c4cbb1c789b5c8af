"""The report of a campaign: each scenario's pass rate with its confidence interval, and failures by reason and seed."""

from __future__ import annotations

import math
import os
import re
import shlex
import statistics
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from roboglot.testing.campaign.table import Row
from roboglot.testing.campaign.trials import Outcome, named

Z = 1.96  # of a normal distribution, for 95 %
REASONS_MAX, SEEDS_MAX = 5, 10


def report(rows: Sequence[Row], folder: Path, wanted: int) -> str:
    """Return the report as Markdown; ``folder``: of the scenarios; ``wanted``: planned number of trials."""
    by_scenario: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_scenario[row.scenario].append(row)
    passed = sum(row.outcome is Outcome.PASSED for row in rows)
    lines = ["# Campaign", "", f"{passed} of {len(rows)} trials passed; {len(rows)} of {wanted} were played.", ""]
    lines += ["| scenario | passed | of | share, 95 % sure | median s | p95 s |", "|---|---|---|---|---|---|"]
    for scenario, own in sorted(by_scenario.items()):
        fine = sum(row.outcome is Outcome.PASSED for row in own)
        low, high = interval(fine, len(own))
        times = sorted(row.seconds for row in own)
        late = times[min(len(times) - 1, math.ceil(0.95 * len(times)) - 1)]
        share = f"{100 * low:.1f} to {100 * high:.1f} %"
        lines.append(
            f"| {_plain(scenario)} | {fine} | {len(own)} | {share} | {statistics.median(times):.1f} | {late:.1f} |"
        )
    for scenario, own in sorted(by_scenario.items()):
        lines += _reasons(folder / named(scenario), [row for row in own if row.outcome is not Outcome.PASSED])
    return "\n".join([*lines, ""])


def interval(passed: int, count: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of the pass rate, 0 to 1 (Wilson's score interval)."""
    if not count:
        return 0.0, 1.0
    share, spread = passed / count, Z * Z / count
    middle = (share + spread / 2) / (1 + spread)
    half = Z / (1 + spread) * math.sqrt(share * (1 - share) / count + spread / (4 * count))
    return max(0.0, min(share, middle - half)), min(1.0, max(share, middle + half))


def _reasons(scenario: Path, failed: Sequence[Row]) -> Iterator[str]:
    """Yield the most frequent reasons, each with the command that plays its first case again."""
    if not failed:
        return
    kinds: dict[str, list[Row]] = defaultdict(list)
    for row in failed:
        kinds[f"{row.outcome}: {re.sub(r'[-+]?[0-9]+(?:[.][0-9]+)?', '#', row.why)}"].append(row)
    yield from ("", f"## {_plain(Path(failed[0].scenario).name)}", "")
    for kind, _ in Counter({kind: len(own) for kind, own in kinds.items()}).most_common(REASONS_MAX):
        own = sorted(kinds[kind], key=lambda row: row.seed)
        seeds = ", ".join(str(row.seed) for row in own[:SEEDS_MAX]) + (" …" if len(own) > SEEDS_MAX else "")
        yield f"- {len(own)} x {own[0].outcome}: {_plain(own[0].why) or 'no reason'} (seeds {seeds}):"
        yield f"  `roboglot test {_quoted(str(scenario))} --seed {own[0].seed}`"


def _quoted(path: str) -> str:
    """Return the path for a shell, in a code span of one line; bash reads what is written out in it."""
    text = os.fsencode(path).replace(b"\\", b"\\\\").decode("utf-8", "backslashreplace")
    odd = re.sub("[\0-\x1f\x7f`]", lambda found: f"\\x{ord(found[0]):02x}", text)
    if odd == path.replace("\\", "\\\\"):
        return shlex.quote(path)
    return "$'" + odd.replace("'", "\\'") + "'"


def _plain(text: str) -> str:
    return " ".join(text.split()).replace("|", "/")
