"""The objects by which a program calls the host: ``cyberdog`` and the other first parts of the prelude's dotted names.

Knows names only: calls become functions, attributes are fetched at every read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from roboglot.programs.worker.prelude import Prelude
from roboglot.spelling import meant

HostCall = Callable[..., object]


def build_roots(prelude: Prelude, call: HostCall) -> dict[str, object]:
    """Return the root objects by name; ``call(name, *args, **kwargs)`` calls the host."""
    tree: dict[str, Any] = {}
    for name in sorted(prelude.calls | prelude.attributes):
        *path, leaf = name.split(".")
        branch = tree
        for part in path:
            branch = branch.setdefault(part, {})
        branch[leaf] = _Attribute(name) if name in prelude.attributes else _function(name, call)
    return {name: _object(name, node, call) if isinstance(node, dict) else node for name, node in tree.items()}


def build_enums(prelude: Prelude) -> dict[str, object]:
    """Return an object for each enum, with the members' numbers as attributes."""
    return {name: _Namespace(name, dict(members), None) for name, members in prelude.enums.items()}


class _Attribute:
    """Marker of a name that is fetched at every read."""

    __slots__ = ("name",)

    def __init__(self, name: str) -> None:
        self.name = name


def _function(name: str, call: HostCall) -> Callable[..., object]:
    def function(*args: object, **kwargs: object) -> object:
        return call(name, *args, **kwargs)

    function.__name__ = function.__qualname__ = name.rpartition(".")[2]
    return function


def _object(name: str, members: dict[str, object], call: HostCall) -> _Namespace:
    built = {
        key: _object(f"{name}.{key}", value, call) if isinstance(value, dict) else value
        for key, value in members.items()
    }
    return _Namespace(name, built, call)


class _Namespace:
    """A read-only object whose attributes are its members."""

    __slots__ = ("__call", "__dict__", "__members", "__name")

    def __init__(self, name: str, members: dict[str, object], call: HostCall | None) -> None:
        object.__setattr__(self, "_Namespace__name", name)
        object.__setattr__(self, "_Namespace__members", members)
        object.__setattr__(self, "_Namespace__call", call)
        # Found without ``__getattr__``, which handles only fetched and missing names.
        self.__dict__.update({key: member for key, member in members.items() if not isinstance(member, _Attribute)})

    def __getattr__(self, part: str) -> Any:
        try:
            member = self.__members[part]
        except KeyError:
            raise AttributeError(_missing(self.__name, part, self.__members)) from None
        if isinstance(member, _Attribute) and self.__call is not None:
            return self.__call(member.name)
        return member

    def __setattr__(self, part: str, value: object) -> None:
        raise AttributeError(f"'{self.__name}.{part}' cannot be changed")

    def __delattr__(self, part: str) -> None:
        raise AttributeError(f"'{self.__name}.{part}' cannot be deleted")

    def __dir__(self) -> list[str]:
        return sorted(self.__members)

    def __repr__(self) -> str:
        return f"<{self.__name}>"


def _missing(owner: str, part: str, members: Iterable[str]) -> str:
    return f"'{owner}' has no '{part}'{meant(part, members)}"
