"""YAML that refuses a key given twice; PyYAML silently takes the last one."""

from __future__ import annotations

from collections.abc import Hashable

from yaml import MappingNode, SafeLoader, ScalarNode, load
from yaml.constructor import ConstructorError


class _Loader(SafeLoader):
    def construct_mapping(self, node: MappingNode, deep: bool = False) -> dict[Hashable, object]:
        keys = set[str]()
        for key in (key for key, _ in node.value if isinstance(key, ScalarNode)):
            if key.value in keys:
                raise ConstructorError(None, None, f"{key.value!r} is given twice", key.start_mark)
            keys.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(text: str) -> object:
    """Return the values of a document. Raises yaml.YAMLError."""
    return load(text, _Loader)
