"""Content of a cloud folder, in our own form: the protocol of the vendor's cloud is not public."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from roboglot.wire.slamware.chapters.delivery import CargoEntry, Destination
from roboglot.wire.slamware.chapters.industry import OPERATIONS_MAX, WAIT_MAX

Number = Annotated[str, msgspec.Meta(pattern=r"^[\w.-]{1,64}$")]


class RoundTarget(msgspec.Struct):
    """A point of a round, its action, and the wait (s; 0: until the operation is ended)."""

    target_name: Annotated[str, msgspec.Meta(min_length=1, max_length=256)]
    action: Annotated[str, msgspec.Meta(max_length=256)] = ""
    wait_time: Annotated[int, msgspec.Meta(ge=0, le=WAIT_MAX)] = 0


class CloudTask(msgspec.Struct):
    """A delivery task as in ``POST tasks``, or of three kinds that only a cloud creates.

    STATION_TAKEOUT: the first task point is the cabinet. INDUSTRY: a round through ``task_targets``. DISINFECT: not
    supported by any robot here.
    """

    type: Literal[
        "TAKEOUT", "GUIDE", "FOOD_DELIVERY", "RETURN", "RECYCLE", "TAKEOUT_DISTRIBUTE",
        "STATION_TAKEOUT", "INDUSTRY", "DISINFECT",
    ]  # fmt: skip
    location: Destination | None = None
    cargos: Annotated[list[CargoEntry], msgspec.Meta(max_length=OPERATIONS_MAX)] | None = None
    task_targets: Annotated[list[RoundTarget], msgspec.Meta(max_length=OPERATIONS_MAX)] = []
    order_id: Number = ""
