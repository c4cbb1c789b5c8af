"""YAML that refuses a key given twice, of which PyYAML silently takes the last one, and numbers that are not finite.

A check of a value against NaN would hold for any value.
"""

from __future__ import annotations

import math
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

    def construct_yaml_float(self, node: ScalarNode) -> float:
        value = super().construct_yaml_float(node)
        if not math.isfinite(value):
            raise ConstructorError(None, None, f"{node.value} is not a finite number", node.start_mark)
        return value


_Loader.add_constructor("tag:yaml.org,2002:float", _Loader.construct_yaml_float)


def read_yaml(text: str) -> object:
    """Return the values of a document. Raises ValueError."""
    return parse_yaml(text, _Loader)
