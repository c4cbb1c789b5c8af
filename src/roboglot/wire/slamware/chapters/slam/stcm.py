"""Composite maps (.stcm): a container of layers, each with text by key and a payload.

The vendor has not published the format; this is the form that real clients read and write. Little endian. File: "STCM",
four uint16 (18, 1, 1, 1), uint32 number of layers, pairs, layers. Layer: uint32 size, pairs, payload. Pairs: uint16
count, then per pair uint16 length and key, uint16 length and value. Some writers include the size field in the size,
some do not; both are read. ``stcm_layers`` decodes payloads; here every layer is kept byte for byte.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import field

from roboglot.values import dataclass
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap

MAGIC = b"STCM"
VERSION = (18, 1, 1, 1)
MAP_BYTES_MAX = 64 << 20
LAYERS_MAX = 1000
PAIRS_MAX = 1000  # per layer
TEXT_MAX = 0xFFFF  # bytes of a key or a value
_VERSION, _SIZE, _SHORT = struct.Struct("<4H"), struct.Struct("<I"), struct.Struct("<H")

Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Layer:
    """A layer; ``pairs`` keep their order, and bytes that are not UTF-8 as surrogates."""

    pairs: Pairs
    payload: bytes = b""

    @property
    def metadata(self) -> Mapping[str, str]:
        """Values of the pairs by key; of repeated keys the last one counts."""
        return dict(self.pairs)


@dataclass(frozen=True, slots=True)
class CompositeMap:
    """All layers. ``pairs``: those of the file; ``tail``: bytes after the layers; both are usually empty."""

    layers: tuple[Layer, ...] = ()
    version: tuple[int, int, int, int] = VERSION
    pairs: Pairs = ()
    tail: bytes = field(default=b"")


def encode_stcm(composite: CompositeMap) -> bytes:
    """Return the bytes of ``composite``; sizes include their own field. Raises BadMap beyond the bounds."""
    if len(composite.layers) > LAYERS_MAX:
        raise BadMap(f"more than {LAYERS_MAX} layers")
    parts = [MAGIC, _VERSION.pack(*composite.version), _SIZE.pack(len(composite.layers)), pack_pairs(composite.pairs)]
    for layer in composite.layers:
        head = pack_pairs(layer.pairs)
        parts += [_SIZE.pack(_SIZE.size + len(head) + len(layer.payload)), head, layer.payload]
    data = b"".join([*parts, composite.tail])
    if len(data) > MAP_BYTES_MAX:
        raise BadMap(f"more than {MAP_BYTES_MAX} bytes")
    return data


def decode_stcm(data: bytes) -> CompositeMap:
    """Return the map in ``data``. Raises BadMap."""
    if len(data) > MAP_BYTES_MAX:
        raise BadMap(f"more than {MAP_BYTES_MAX} bytes")
    if not data.startswith(MAGIC):
        raise BadMap("it does not begin with STCM")
    reader = Reader(data, len(MAGIC))
    a, b, c, d = _VERSION.unpack(reader.take(_VERSION.size))
    (count,) = _SIZE.unpack(reader.take(_SIZE.size))
    if count > LAYERS_MAX:
        raise BadMap(f"more than {LAYERS_MAX} layers")
    pairs, begin = reader.pairs(), reader.at
    try:
        layers, end = _layers(data, begin, count, counted_in=_SIZE.size)
    except BadMap as error:
        try:
            layers, end = _layers(data, begin, count, counted_in=0)
        except BadMap:
            raise error from None
    return CompositeMap(layers, (a, b, c, d), pairs, data[end:])


def _layers(data: bytes, begin: int, count: int, counted_in: int) -> tuple[tuple[Layer, ...], int]:
    """Return ``count`` layers from ``begin`` on, and their end; sizes include ``counted_in`` bytes of themselves."""
    reader, layers = Reader(data, begin), []
    for number in range(count):
        size = _SIZE.unpack(reader.take(_SIZE.size))[0] - counted_in
        if size < _SHORT.size or size > len(data) - reader.at:
            raise BadMap(f"layer {number} cannot have {size + counted_in} bytes")
        inner = Reader(reader.take(size))
        layers.append(Layer(inner.pairs(), inner.rest()))
    return tuple(layers), reader.at


def pack_pairs(pairs: Pairs) -> bytes:
    """Return the bytes of pairs, as used before layers and in entries. Raises BadMap beyond the bounds."""
    if len(pairs) > PAIRS_MAX:
        raise BadMap(f"more than {PAIRS_MAX} pairs")
    return _SHORT.pack(len(pairs)) + b"".join(pack_text(key) + pack_text(value) for key, value in pairs)


def pack_text(text: str) -> bytes:
    """Return a text as length and bytes. Raises BadMap beyond ``TEXT_MAX``."""
    data = text.encode("utf-8", "surrogateescape")
    if len(data) > TEXT_MAX:
        raise BadMap(f"a text of {len(data)} bytes")
    return _SHORT.pack(len(data)) + data


class Reader:
    """Takes values from the front of bytes. Raises BadMap if there are too few."""

    def __init__(self, data: bytes, at: int = 0) -> None:
        self._data = data
        self.at = at

    def take(self, size: int) -> bytes:
        """Return the next ``size`` bytes."""
        end = self.at + size
        if end > len(self._data):
            raise BadMap(f"it ends at {len(self._data)}, in the middle of something of {size} bytes at {self.at}")
        taken = self._data[self.at : end]
        self.at = end
        return taken

    def rest(self) -> bytes:
        """Return all remaining bytes."""
        return self.take(len(self._data) - self.at)

    def short(self) -> int:
        """Return a uint16."""
        return int(_SHORT.unpack(self.take(_SHORT.size))[0])

    def text(self) -> str:
        """Return a text that is stored as length and bytes."""
        return self.take(self.short()).decode("utf-8", "surrogateescape")

    def pairs(self) -> Pairs:
        """Return pairs that are stored after their number."""
        count = self.short()
        if count > PAIRS_MAX:
            raise BadMap(f"more than {PAIRS_MAX} pairs")
        return tuple((self.text(), self.text()) for _ in range(count))
