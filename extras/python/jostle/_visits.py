# SPDX-License-Identifier: MIT
"""Pairs in arrays, from what hands them over as it finds them."""
from __future__ import annotations

from typing import Any, Callable

import numpy as np

from . import _arrays
from ._errors import Error
from ._lists import ClosePairs

#: Takes answers, ids (n,) or pairs (n, 2), and where they are, (n,) float64. None or True: go on. False: stop. A number: go on,
#: but no further than that.
Visit = Callable[[np.ndarray, np.ndarray], Any]


def all_pairs(visit_pairs: Callable[[Visit, int], bool]) -> np.ndarray:
    """All that visit_pairs(visit, chunk) hands over."""
    parts: list[np.ndarray] = [np.empty((0, 2), np.uint32)]
    visit_pairs(lambda pairs, at: parts.append(pairs), 2**16)
    return np.concatenate(parts)


def first_pairs(count: int, dtype: Any, visit_closest_pairs: Callable[[Visit, int], bool]) -> ClosePairs:
    """The first `count` that visit_closest_pairs(visit, chunk) hands over."""
    if _arrays.whole(count, "count", 2**63) < 1:
        raise Error(f"count is {count}: it must be at least 1")
    found = [ClosePairs(np.empty((0, 2), dtype), np.empty(0))]

    def visit(pairs: np.ndarray, at: np.ndarray) -> bool:
        found[0] = ClosePairs(pairs, at)
        return False

    visit_closest_pairs(visit, count)
    return found[0]
