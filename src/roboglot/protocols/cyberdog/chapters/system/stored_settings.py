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
    """Return what was set under ``key``; ``default`` for a robot that keeps no settings."""
    return robot[Settings].get(key, default) if Settings in robot else default


def nickname(robot: Robot) -> str:
    """The name that the robot goes by now."""
    return str(kept(robot, NICKNAME, DEFAULT_NAME)) if kept(robot, NICKNAME_ON, False) else DEFAULT_NAME


def wake_words(robot: Robot) -> tuple[str, ...]:
    """Return what it listens to: its default name said twice, and the nickname's word while that is on."""
    own = (DEFAULT_NAME * 2,)
    word = str(kept(robot, WAKE_WORD, ""))
    return (*own, word) if word and kept(robot, NICKNAME_ON, False) else own
