"""Announcements of a delivery robot, in the language that its operator set."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.system.settings import Settings
from roboglot.model.events import DeliveryNews, DeliveryReported
from roboglot.model.robot import Robot

LANGUAGE, LANGUAGE_AT_FIRST = "slamware.language", "zh-CN"
# News -> Chinese, English. Languages that do not begin with zh use English.
PHRASES = {
    DeliveryNews.ORDER_STARTED: ("开始配送,请让一让", "I am on my way."),
    DeliveryNews.STATION_STARTED: ("去取货", "I am going to the cabinet."),
    DeliveryNews.ARRIVED: ("您的物品到了,请取走", "I am here. Please take what is yours."),
    DeliveryNews.BACK_TO_RECEPTION: ("无人取件,返回前台", "Nobody came. I am going back to reception."),
    DeliveryNews.BATTERY_LOW: ("电量低,我去充电", "My battery is low. I am going to charge."),
    DeliveryNews.PLACE_LOST: ("我迷路了,请帮帮我", "I have lost my way. Please push me to my dock."),
    DeliveryNews.WORK_ENDED: ("我下班了", "My work is done for today."),
}


def language_of(robot: Robot) -> str:
    """Return the language; Chinese by default."""
    return str(robot[Settings].get(LANGUAGE, LANGUAGE_AT_FIRST))


class Voice:
    """Announces news of the delivery service."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._end: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Start listening for news; a robot without a loudspeaker is silent."""
        if Speaker in self._robot and Settings in self._robot:
            self._end = self._robot.events.listen(DeliveryReported, self._speak)

    def close(self) -> None:
        """Stop announcements."""
        self._end()

    def _speak(self, event: DeliveryReported) -> None:
        if (phrases := PHRASES.get(event.news)) is not None:
            chinese, english = phrases
            text = chinese if language_of(self._robot).lower().startswith("zh") else english
            self._robot[Speaker].say(text, source="delivery")
