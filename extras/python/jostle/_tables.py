# SPDX-License-Identifier: MIT
"""Boxes from comma-separated values, by the rules and with the messages of `jostle pairs`."""
from __future__ import annotations

import csv
import io
import math
import re
from typing import NamedTuple, NoReturn

import numpy as np

from ._errors import Error

_ADVICE = ("the first line may name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z], or xmin,..., or x,y[,z],w,h[,d], and maybe id, "
           "in any order; without names there are 4 or 6 columns in the first of these orders")
# What a column has of a box: an axis has two of these, its lower bound, and its upper one or the size.
_LO, _HI, _SIZE = range(3)
_NUMBER = re.compile(r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?|inf(?:inity)?|nan)", re.ASCII | re.IGNORECASE)


class _Column(NamedTuple):
    place: int
    name: str  # as the file has it


def _own_name(bound: int, axis: int) -> str:
    return "whd"[axis] if bound == _SIZE else ("lo_", "hi_")[bound] + "xyz"[axis]


def _names() -> dict[str, tuple[int, int]]:
    """Our own names, and those that spreadsheets, GeoPandas and detectors of images write."""
    names = {_own_name(bound, axis): (bound, axis) for bound in (_LO, _HI, _SIZE) for axis in range(3)}
    for axis, a in enumerate("xyz"):
        names[a] = (_LO, axis)
        for bound, end in ((_LO, "min"), (_HI, "max")):
            names.update(dict.fromkeys((end + a, a + end, f"{end}_{a}", f"{a}_{end}"), (bound, axis)))
    return names


_NAMES = _names()


def _shortened(text: str) -> str:
    short = text[:40] + "..." if len(text) > 40 else text
    return re.sub(r"[\0-\x1f\x7f]", lambda c: f"\\x{ord(c[0]):02x}", short)


class _Table:
    def __init__(self, text: str, name: str) -> None:
        self._rows = csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), skipinitialspace=True)
        self._name = name
        self._line = 1
        self.fields: list[str] = []
        self.index: int | None = None  # of the box in this row
        self.id: int | None = None
        self.of: dict[tuple[int, int], _Column] = {}
        self._read_header()

    def fail(self, place: int, what: str) -> NoReturn:
        raise Error(f"{self._name}:{self._line}:{place + 1}: {what}", self.index, "bad_file")

    def next(self) -> bool:
        """Goes to the next row that isn't blank; false at the end."""
        while True:
            self._line = self._rows.line_num + 1
            row = next(self._rows, None)
            if row is None:
                return False
            self.fields = [field.strip(" \t") for field in row]
            if len(row) > 1 or self.fields not in ([], [""]):
                return True

    def _read_header(self) -> None:
        if not self.next():
            self.fail(0, f"the file is empty; {_ADVICE}")
        self.columns = len(self.fields)
        self.named = not all(_NUMBER.fullmatch(field) for field in self.fields)  # else the first line is a box
        if not self.named:
            if self.columns not in (4, 6):
                self.fail(0, f"there is no line with names, and {self.columns} column{'s' * (self.columns > 1)}; {_ADVICE}")
            self.dim = self.columns // 2
            for place in range(self.columns):
                side, axis = divmod(place, self.dim)
                self.of[side, axis] = _Column(place, _own_name(side, axis))
            return
        for place, field in enumerate(self.fields):
            name = field.lower()
            what = _NAMES.get(name)
            if what is None and name != "id":
                self.fail(place, f'column "{_shortened(field)}" is not known; {_ADVICE}')
            if self.id is not None if what is None else what in self.of:
                self.fail(place, f"column {name} is there twice; remove one")
            if what is None:
                self.id = place
            else:
                self.of[what] = _Column(place, name)
        self.dim = 3 if any(axis == 2 for _, axis in self.of) else 2
        for bound in (_LO, _HI):
            for axis in range(self.dim):
                here, size = self.of.get((bound, axis)), self.of.get((_SIZE, axis))
                if bound == _HI and here and size:
                    self.fail(max(here.place, size.place), f"columns {here.name} and {size.name} say the same; remove one")
                if not here and not (bound == _HI and size):
                    self.fail(self.columns, f"column {_own_name(bound, axis)} is missing; {_ADVICE}")

    def _number(self, column: _Column) -> float:
        place, name = column
        text = self.fields[place]
        if not text:
            self.fail(place, f"{name} is empty; write a number")
        if not _NUMBER.fullmatch(text):
            self.fail(place, f'{name} is "{_shortened(text)}", which is not a number; write one like -12.5, 1e-3 or inf')
        value = float(text)
        if math.isinf(value) and "f" not in text.lower():
            self.fail(place, f'{name} is "{_shortened(text)}", which is more than a double can hold; write inf if it is meant to be '
                             "unbounded")
        if math.isnan(value):
            self.fail(place, f"{name} is NaN; every bound must be a number (inf is allowed)")
        return value

    def bounds(self, axis: int) -> tuple[float, float]:
        low, size = self.of[_LO, axis], self.of.get((_SIZE, axis))
        high = size or self.of[_HI, axis]
        lo, other = self._number(low), self._number(high)
        here, there = (f"{name} = {_shortened(self.fields[place])}" for place, name in (low, high))
        if size is None:
            if lo > other:
                self.fail(low.place, f"{here} is greater than {there}; swap them or drop the box")
            return lo, other
        if other < 0:
            self.fail(high.place, f"{there} is below 0; a box begins at {low.name} and has this size")
        hi = lo + other
        if math.isnan(hi) or (math.isinf(hi) and not math.isinf(lo) and not math.isinf(other)):
            self.fail(high.place, f"{low.name} + {high.name} is no number that a double can hold; write the upper bound as "
                                  f"hi_{'xyz'[axis]}")
        return lo, hi


def read_csv(text: str, name: str) -> tuple[np.ndarray, list[str] | None]:
    """Boxes, and their ids if there are any. Messages begin with the file's name, the line and the column."""
    table = _Table(text, name)
    rows: list[list[float]] = []
    ids: dict[str, int] = {}
    here = not table.named
    while here or table.next():
        here = False
        table.index = len(rows)
        if len(table.fields) != table.columns:
            table.fail(min(len(table.fields), table.columns),
                       f"the row has {len(table.fields)} fields and the {'header' if table.named else 'first'} {table.columns}; "
                       "give each column one value")
        bounds = [table.bounds(axis) for axis in range(table.dim)]
        if table.id is not None:
            box = table.fields[table.id]
            if not box:
                table.fail(table.id, "id is empty; name the box, or leave the column out")
            if box in ids:
                table.fail(table.id, f'id "{_shortened(box)}" already names box {ids[box]} (the first is 0); make them differ, or '
                                     "leave the column out")
            ids[box] = len(rows)
        rows.append([lo for lo, _ in bounds] + [hi for _, hi in bounds])
    return np.array(rows, np.float64).reshape(-1, 2 * table.dim), None if table.id is None else list(ids)
