"""Settings of the dog that survive restarts: their keys and defaults. Knows no message."""

from __future__ import annotations

from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot

DEFAULT_NAME = "铁蛋"
NICKNAME_ON, NICKNAME, WAKE_WORD = "cyberdog.nickname_on", "cyberdog.nickname", "cyberdog.wake_word"
MICROPHONE, VOICE_CONTROL = "cyberdog.microphone", "cyberdog.voice_control"
ACCOUNT = "cyberdog.audio_account"
VOICEPRINTS = "cyberdog.voiceprints"  # as the app sent them
ENVIRONMENT = "cyberdog.environment"
APP = "cyberdog.app"  # the host of the last connected app
UPDATE = "cyberdog.update"  # the version for which the robot restarts


def kept(robot: Robot, key: str, default: object) -> object:
    """Return the setting ``key``; ``default`` for a robot without settings."""
    return robot[Settings].get(key, default) if Settings in robot else default


def nickname(robot: Robot) -> str:
    """Return the current name of the robot."""
    return str(kept(robot, NICKNAME, DEFAULT_NAME)) if kept(robot, NICKNAME_ON, False) else DEFAULT_NAME


def wake_words(robot: Robot) -> tuple[str, ...]:
    """Return the wake words: the default name said twice, and the nickname's word while that is on."""
    own = (DEFAULT_NAME * 2,)
    word = str(kept(robot, WAKE_WORD, ""))
    return (*own, word) if word and kept(robot, NICKNAME_ON, False) else own
