# SPDX-License-Identifier: MIT
"""Results of many queries: a list for each."""
from __future__ import annotations

from typing import Iterator, NamedTuple

import numpy as np


class Hits(NamedTuple):
    """One answer per query."""

    ids: np.ndarray  #: of an index int64, -1 where there is none; of a world uint64, 0 where there is none
    at: np.ndarray  #: float64: the least fraction at which the box is touched; infinite where there is none


class ClosePairs(NamedTuple):
    """Pairs of boxes, the closest first."""

    pairs: np.ndarray  #: (m, 2): of indexes uint32, of worlds uint64, ids
    at: np.ndarray  #: (m,) float64: squared distances


class Lists:
    """One list for each query, all in one array: lists[i] is what was found for query i.

    first   list i is values[first[i]:first[i + 1]]
    values  all lists, one after the other
    more    whether query i has more than max_results
    """

    _each = "values"  #: what a value is called, in repr()

    def __init__(self, first: np.ndarray, values: np.ndarray, more: np.ndarray) -> None:
        self.first, self.values, self.more = first, values, more

    def __len__(self) -> int:
        return len(self.first) - 1

    def __getitem__(self, i: int) -> np.ndarray:
        if not -len(self) <= i < len(self):
            raise IndexError(f"there are {len(self)} queries, and none of number {i}")
        i %= len(self)
        return self.values[int(self.first[i]):int(self.first[i + 1])]

    def __iter__(self) -> Iterator[np.ndarray]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} queries, {len(self.values)} {self._each})"

    def query_of(self) -> np.ndarray:
        """The number of the query of each value, for grouping."""
        return np.repeat(np.arange(len(self)), np.diff(self.first.astype(np.int64)))


class Answers(Lists):
    """A list of answers per query: answers[i] are the ids of query i, in the order of its kind of query.

    ids    all of them, one list after the other; `values` is the same array
    at     for rays and sweeps the fraction, for nearest the squared distance; else None
    first  list i is [first[i], first[i + 1])
    more   whether query i has more answers than max_results
    """

    _each = "answers"

    def __init__(self, first: np.ndarray, ids: np.ndarray, at: np.ndarray | None, more: np.ndarray) -> None:
        super().__init__(first, ids, more)
        self.at = at

    @property
    def ids(self) -> np.ndarray:
        return self.values


class ShapeAnswers(Lists):
    """A list of shapes per query, nearest first: answers[i] is a structured array with the fields that first() has.

    values  all of them, one list after the other
    first   list i is values[first[i]:first[i + 1]]
    more    whether query i has more answers than max_results
    """

    _each = "answers"
