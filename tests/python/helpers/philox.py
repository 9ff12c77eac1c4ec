"""Random numbers by counter, written a second time in numpy: Philox4x32-10 (Salmon et al., SC11).

Lanes are samples: everything takes an array of counters.
"""

from __future__ import annotations

import numpy as np

VIRTUAL_CALIBRATION = 32
MONTE_CARLO = 33
WORD = np.uint64(0xFFFFFFFF)
HALF = np.uint64(32)


def philox(counter: list[np.ndarray], key: tuple[int, int]) -> list[np.ndarray]:
    """Ten rounds of Philox4x32 on four words each."""
    c = [np.asarray(word, dtype=np.uint64) for word in counter]
    k = list(key)
    for _ in range(10):
        a, b = np.uint64(0xD2511F53) * c[0], np.uint64(0xCD9E8D57) * c[2]
        high_a, low_a, high_b, low_b = a >> HALF, a & WORD, b >> HALF, b & WORD
        c = [high_b ^ c[1] ^ np.uint64(k[0]), low_b, high_a ^ c[3] ^ np.uint64(k[1]), low_a]
        k = [(k[0] + 0x9E3779B9) & 0xFFFFFFFF, (k[1] + 0xBB67AE85) & 0xFFFFFFFF]
    return c


def uniform_pair(seed: int, stream: int, sample: np.ndarray, item: int, draw: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Middles of 2^53 equal parts of (0, 1), from the block of words sample (low, high), item, stream + 2^16 draw."""
    counter = np.atleast_1d(np.asarray(sample, dtype=np.uint64))
    same = np.ones_like(counter)
    words = philox(
        [counter & WORD, counter >> HALF, same * np.uint64(item), same * np.uint64(stream | draw << 16)],
        (seed & 0xFFFFFFFF, seed >> 32),
    )
    first, second = (low | high << HALF for low, high in (words[:2], words[2:]))
    u, v = (((word >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53 for word in (first, second))
    return u, v


def normal_pair(seed: int, stream: int, sample: np.ndarray, item: int, draw: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Box and Muller."""
    u, v = uniform_pair(seed, stream, sample, item, draw)
    radius = np.sqrt(-2.0 * np.log(u))
    return radius * np.cos(2.0 * np.pi * v), radius * np.sin(2.0 * np.pi * v)
