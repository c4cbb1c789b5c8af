"""The task that leaves a spare process with Ray: idle, with everything loaded, for the next shard that is restarted.

Loading takes some four seconds of processor time, half a minute beside busy processes. Where Ray ends idle processes
after a second, as is its default, a shard's process starts from the beginning as usual. Does not depend on Ray.
"""

from __future__ import annotations


def become_spare() -> None:
    """Load everything that a shard needs, unless shards still compile kernels: a second compiler would disturb them."""
    from roboglot.kernels.ahead import missing
    from roboglot.shards.warm_up import load

    if not missing():
        load()
