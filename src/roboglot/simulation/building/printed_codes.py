"""The squares of printed codes, readable by standard readers: AprilTags of the family 36h11, and QR codes.

Arrays of 1 (black) and 0 (white), row 0 at the top, without the white margin. Knows no picture and no world.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Squares = NDArray[np.uint8]
QR_BYTES_MAX = 106  # in the largest code produced here
_FAMILY = Path(__file__).parent / "april_36h11.bin"  # 36 bits in 5 bytes each, row by row, 1 is white
# By version, error correction level L, one block: bytes of data and of correction.
_QR_SIZES = {1: (19, 7), 2: (34, 10), 3: (55, 15), 4: (80, 20), 5: (108, 26)}
_UNSET = 2


@cache
def _family() -> tuple[int, ...]:
    codes = _FAMILY.read_bytes()
    return tuple(int.from_bytes(codes[at : at + 5], "big") for at in range(0, len(codes), 5))


def april(number: int) -> Squares:
    """Return a tag, 8 x 8: 36 bits within a black rim. Raises ValueError for a number outside the family."""
    family = _family()
    if not 0 <= number < len(family):
        raise ValueError(f"the family has tags 0 to {len(family) - 1}, not {number}")
    bits = [1 - (family[number] >> place & 1) for place in range(35, -1, -1)]
    return np.pad(np.array(bits, dtype=np.uint8).reshape(6, 6), 1, constant_values=1)


def qr(text: str) -> Squares:
    """Return a QR code, 21 x 21 to 37 x 37. Raises ValueError for a text above QR_BYTES_MAX bytes (UTF-8)."""
    data = text.encode()
    version = next((v for v, (size, _) in _QR_SIZES.items() if len(data) <= size - 2), None)
    if version is None:
        raise ValueError(f"a QR code holds up to {QR_BYTES_MAX} bytes here, not {len(data)}")
    size, correction = _QR_SIZES[version]
    words = _words(data, size)
    words += _corrections(words, correction)
    squares = _frame(version)
    _fill(squares, words)
    return squares


def _words(data: bytes, size: int) -> list[int]:
    """Return the code words: mode (bytes), length, data, end and padding."""
    bits = f"0100{len(data):08b}" + "".join(f"{byte:08b}" for byte in data) + "0000"
    words = [int(bits[i : i + 8], 2) for i in range(0, len(bits), 8)]
    return words + [(0xEC, 0x11)[i % 2] for i in range(size - len(words))]


def _times(a: int, b: int) -> int:
    """Return the product in the field of 256 elements of QR codes."""
    result = 0
    while b:
        if b & 1:
            result ^= a
        a, b = a << 1 ^ (0x11D if a & 0x80 else 0), b >> 1
    return result


def _corrections(words: list[int], count: int) -> list[int]:
    """Return the Reed-Solomon words: the remainder of the division by (x - 1)(x - 2)(x - 4)..."""
    divisor, root = [1], 1
    for _ in range(count):
        divisor = [a ^ _times(b, root) for a, b in zip([*divisor, 0], [0, *divisor], strict=True)]
        root = _times(root, 2)
    rest = [*words, *[0] * count]
    for i in range(len(words)):
        factor = rest[i]
        for j, coefficient in enumerate(divisor):
            rest[i + j] ^= _times(coefficient, factor)
    return rest[-count:]


def _frame(version: int) -> Squares:
    """Return the code before its data: finders, timing, alignment and format; the rest is _UNSET."""
    n = 17 + 4 * version
    squares = np.full((n, n), _UNSET, dtype=np.uint8)
    squares[6, :] = squares[:, 6] = (np.arange(n) + 1) % 2
    finder = np.array([[max(abs(r), abs(c)) not in (2, 4) for c in range(-4, 5)] for r in range(-4, 5)], dtype=np.uint8)
    squares[:8, :8], squares[:8, -8:], squares[-8:, :8] = finder[1:, 1:], finder[1:, :-1], finder[:-1, 1:]
    if version > 1:
        middle = n - 7
        squares[middle - 2 : middle + 3, middle - 2 : middle + 3] = [
            [max(abs(r), abs(c)) != 1 for c in range(-2, 3)] for r in range(-2, 3)
        ]
    _write_format(squares)
    return squares


def _write_format(squares: Squares) -> None:
    """Write the format (level L, mask 0) twice, and the dark square."""
    n, rest = len(squares), 0b01000 << 10
    for place in range(14, 9, -1):
        if rest >> place & 1:
            rest ^= 0b10100110111 << (place - 10)
    bits = (0b01000 << 10 | rest) ^ 0b101010000010010
    around = [(8, i) for i in (0, 1, 2, 3, 4, 5, 7, 8)] + [(i, 8) for i in (7, 5, 4, 3, 2, 1, 0)]
    apart = [(n - 1 - i, 8) for i in range(7)] + [(8, n - 8 + i) for i in range(8)]
    for place in range(15):
        for row, column in (around[place], apart[place]):
            squares[row, column] = bits >> (14 - place) & 1
    squares[n - 8, 8] = 1


def _fill(squares: Squares, words: list[int]) -> None:
    """Write the data up and down in columns of two from the right, masked like a chessboard."""
    n = len(squares)
    bits = iter([word >> place & 1 for word in words for place in range(7, -1, -1)])
    columns = [*range(n - 1, 6, -2), *range(5, 0, -2)]
    for number, right in enumerate(columns):
        rows = range(n - 1, -1, -1) if number % 2 == 0 else range(n)
        for row, column in product(rows, (right, right - 1)):
            if squares[row, column] == _UNSET:
                squares[row, column] = next(bits, 0) ^ ((row + column) % 2 == 0)
