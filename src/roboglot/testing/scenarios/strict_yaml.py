"""YAML that refuses a key given twice; PyYAML silently takes the last one."""

from __future__ import annotations

from collections.abc import Hashable

from yaml import MappingNode, SafeLoader, ScalarNode
from yaml.constructor import ConstructorError

from roboglot.text_files import parse_yaml


class _Loader(SafeLoader):
    def construct_mapping(self, node: MappingNode, deep: bool = False) -> dict[Hashable, object]:
        keys = set[str]()
        for key in (key for key, _ in node.value if isinstance(key, ScalarNode)):
            if key.value in keys:
                raise ConstructorError(None, None, f"{key.value!r} is given twice", key.start_mark)
            keys.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(text: str) -> object:
    """Return the values of a document. Raises ValueError."""
    return parse_yaml(text, _Loader)
