"""Stage that notes changes as inputs, so that a lockstep run can be repeated with them."""

from __future__ import annotations

import base64
import inspect
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import TYPE_CHECKING, TypeVar, cast, get_type_hints

import msgspec

from roboglot.extras import lazy
from roboglot.model.inputs.external import ExternalInputs, Input
from roboglot.model.sound import Samples, Sound
from roboglot.model.stage import Stage, StagePerson

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

STAGE = "hands"  # the kind of these inputs, as in recordings of version 0.2
PERSON, OPTIONS = "person", "options"
LOOKS = frozenset({"world_file", PERSON})  # methods that change nothing
T = TypeVar("T")
S = TypeVar("S", bound=Stage)


def noted(stage: S, inputs: ExternalInputs, before: Callable[[], object]) -> S:
    """Wrap ``stage`` to note its changes, for callers outside the world; call ``before`` ahead of each."""
    return cast(S, _Noted(stage, Stage, inputs, before, {}))


class _Noted:
    """Wrapper of a stage or a person; ``given`` is added to each note."""

    def __init__(
        self,
        inner: object,
        kind: type,
        inputs: ExternalInputs,
        before: Callable[[], object],
        given: Mapping[str, object],
    ) -> None:
        self._inner, self._kind, self._inputs, self._before, self._given = inner, kind, inputs, before, given

    def __getattr__(self, name: str) -> object:
        value = getattr(self._inner, name)
        if name == PERSON:
            return self._person
        if name in LOOKS or not inspect.isfunction(getattr(self._kind, name, None)):
            return value
        return partial(self._carry_out, name, value)

    def __dir__(self) -> list[str]:
        return dir(self._inner)

    def _person(self, name: str) -> StagePerson:
        person = cast(Stage, self._inner).person(name)
        return cast(StagePerson, _Noted(person, StagePerson, self._inputs, self._before, {PERSON: name}))

    def _carry_out(self, name: str, method: Callable[..., T], /, *args: object, **named: object) -> T:
        self._before()
        if not self._inputs.watched:
            return method(*args, **named)
        values = _signature(self._kind, name).bind(None, *args, **named).arguments
        values.pop("self")
        whole = {**self._given, **{key: msgspec.to_builtins(value, enc_hook=_samples) for key, value in values.items()}}
        with self._inputs.noting(STAGE, name, whole):
            return method(*args, **named)


def do_again(stage: Stage, noted: Input) -> None:
    """Repeat a noted change. Raises the errors of the original, and ValueError for an unknown change."""
    values = dict(noted.values)
    target: Stage | StagePerson = stage
    if PERSON in values:
        target = stage.person(str(values.pop(PERSON)))
    kind: type = Stage if target is stage else StagePerson
    method = getattr(kind, noted.name, None)
    if noted.name in LOOKS or not inspect.isfunction(method):
        raise ValueError(noted.name[:50])
    hints = get_type_hints(method)
    options = cast(dict[str, object], values.pop(OPTIONS, {}))
    try:
        arguments = {name: _value(value, hints[name]) for name, value in values.items()}
        getattr(target, noted.name)(**arguments, **options)
    except (KeyError, TypeError, msgspec.ValidationError) as error:
        raise ValueError(f"{noted.name}: {error}") from None


@lru_cache(64)
def _signature(kind: type, name: str) -> inspect.Signature:
    return inspect.signature(getattr(kind, name))


def _samples(value: object) -> str:
    """Return the samples of a sound as text."""
    return base64.b64encode(cast(Samples, value).tobytes()).decode()


def _value(value: object, hint: type) -> object:
    if hint is Sound:
        sound = cast(dict[str, str], value)
        return Sound(sound["name"], np.frombuffer(base64.b64decode(sound["samples"]), np.int16))
    return msgspec.convert(value, hint)
