"""Routines of people, step by step, as written in a world's file. Metres, degrees, seconds. Knows no person."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.perception import Emotion, Gesture, Sport

STEPS_MAX = 200
TEXT_MAX = 300  # characters per utterance

Coordinate = Annotated[float, Meta(ge=-10_000, le=10_000)]
Spot = tuple[Coordinate, Coordinate]
Seconds = Annotated[float, Meta(ge=0, le=3600)]


class Walk(Struct, frozen=True, forbid_unknown_fields=True, tag="walk", tag_field="do"):
    """Walk to a place in a straight line, waiting for robots in the way; ``speed``: m/s, None: the person's own."""

    to: Spot
    speed: Annotated[float, Meta(gt=0, le=3)] | None = None


class Look(Struct, frozen=True, forbid_unknown_fields=True, tag="look", tag_field="do"):
    """Turn to face a place."""

    at: Spot


class Wait(Struct, frozen=True, forbid_unknown_fields=True, tag="wait", tag_field="do"):
    """Stand for ``seconds``."""

    seconds: Seconds = 2.0


class Show(Struct, frozen=True, forbid_unknown_fields=True, tag="gesture", tag_field="do"):
    """Make a gesture for ``seconds``."""

    gesture: Gesture
    seconds: Seconds = 3.0


class Say(Struct, frozen=True, forbid_unknown_fields=True, tag="say", tag_field="do"):
    """Say a text aloud, for as long as that takes."""

    text: Annotated[str, Meta(min_length=1, max_length=TEXT_MAX)]


class Clap(Struct, frozen=True, forbid_unknown_fields=True, tag="clap", tag_field="do"):
    """Clap one's hands."""

    count: Annotated[int, Meta(ge=1, le=20)] = 2


class Exercise(Struct, frozen=True, forbid_unknown_fields=True, tag="sport", tag_field="do"):
    """``count`` repetitions of ``period`` s each; a plank is held for ``count`` times ``period``."""

    sport: Sport
    count: Annotated[int, Meta(ge=1, le=1000)] = 10
    period: Annotated[float, Meta(ge=0.5, le=20)] = 2.0


class Feel(Struct, frozen=True, forbid_unknown_fields=True, tag="feel", tag_field="do"):
    """Show another emotion from now on."""

    emotion: Emotion


Step = Walk | Look | Wait | Show | Say | Clap | Exercise | Feel
