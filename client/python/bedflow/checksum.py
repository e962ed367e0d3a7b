"""CRC32C (RFC 3720, polynomial 0x1EDC6F41) with numpy: lanes of bytes side by side, joined by the linearity of the sum over GF(2)."""
from __future__ import annotations

import numpy as np

_REVERSED_POLYNOMIAL = 0x82F63B78
_LANES = 1024


def _byte_table() -> np.ndarray:
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(_REVERSED_POLYNOMIAL), table >> 1)
    return table.astype(np.uint32)


_TABLE = _byte_table()
_BITS = np.uint32(1) << np.arange(32, dtype=np.uint32)


def _applied(operator: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """A linear operator, given by what it makes of each bit, on many sums."""
    chosen = np.where(sums[..., None] & _BITS, operator, np.uint32(0))
    return np.bitwise_xor.reduce(chosen, axis=-1)


def _behind_zeros(count: int) -> np.ndarray:
    """The operator that takes a sum through so many zero bytes."""
    result, square = _BITS, _TABLE[_BITS & 0xFF] ^ (_BITS >> 8)
    while count:
        if count & 1:
            result = _applied(square, result)
        square = _applied(square, square)
        count >>= 1
    return result


def crc32c(data: bytes) -> int:
    if not data:
        return 0
    length = -(-len(data) // _LANES)
    lanes = np.zeros(_LANES * length, dtype=np.uint8)  # zeros in front change nothing: the raw sum starts with 0
    lanes[len(lanes) - len(data):] = np.frombuffer(data, dtype=np.uint8)
    sums = np.zeros(_LANES, dtype=np.uint32)
    for column in lanes.reshape(_LANES, length).T:
        sums = _TABLE[(sums ^ column) & 0xFF] ^ (sums >> 8)
    operator = _behind_zeros(length)
    while len(sums) > 1:
        sums = _applied(operator, sums[0::2]) ^ sums[1::2]
        operator = _applied(operator, operator)
    start = _applied(_behind_zeros(len(data)), np.array([0xFFFFFFFF], dtype=np.uint32))
    return int(sums[0] ^ start[0] ^ np.uint32(0xFFFFFFFF))
