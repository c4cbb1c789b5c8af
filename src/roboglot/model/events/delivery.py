"""Events of deliveries."""

from __future__ import annotations

from enum import StrEnum

from roboglot.model.events.stream import Event
from roboglot.values import dataclass


class DeliveryNews(StrEnum):
    """News of a delivery for the people at the reception."""

    LEFT_DOCK = "left the dock for an order"
    SETTINGS_CHANGED = "settings changed"
    ORDER_STARTED = "order started"
    BACK_TO_RECEPTION = "back to reception with what nobody took"
    NOT_TAKEN = "nobody took the delivery"
    NOT_COLLECTED = "nobody took it at reception"
    UNDOCK_FAILED = "could not leave the dock"
    WORK_BEGAN = "work began"
    WORK_ENDED = "work ended"
    BATTERY_LOW = "battery low"
    ARRIVED = "arrived at the target"
    ORDER_RECEIVED = "order received from afar"
    STATION_STARTED = "order of a cabinet started"
    AT_CABINET = "the cabinet fills the boxes"
    DISINFECT_FAILED = "could not disinfect"
    PLACE_LOST = "does not know where it is"


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliveryReported(Event):
    """Something worth a report happened to the delivery service."""

    news: DeliveryNews
