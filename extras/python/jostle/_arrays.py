# SPDX-License-Identifier: MIT
"""Conversion of arguments: any source of numbers becomes a NumPy array, without a copy where that is possible."""
from __future__ import annotations

import operator
from typing import Any

import numpy as np

from ._errors import Error

SPACES = {(2, np.dtype(np.float32)): 1, (3, np.dtype(np.float32)): 2,
          (2, np.dtype(np.float64)): 3, (3, np.dtype(np.float64)): 4}


def array(given: Any) -> np.ndarray:
    """Every argument that may be an array goes through here: arrays, buffers, objects with __array_interface__, __array__ or
    __dlpack__, numbers, and sequences of all these. The result has the machine's byte order and is aligned."""
    if hasattr(given, "__dlpack__") and not hasattr(given, "__array_interface__"):
        try:
            out = np.from_dlpack(given)
        except (BufferError, RuntimeError, TypeError) as why:
            raise Error(f"NumPy can't read an argument of the type {type(given).__name__} by its __dlpack__: {why}") from why
    else:
        out = np.asarray(given)
    if out.dtype.kind == "O" and isinstance(given, (list, tuple)) and any(hasattr(one, "__dlpack__") for one in given):
        out = np.asarray([array(one) for one in given])
    return out if out.dtype.isnative and out.flags.aligned else out.astype(out.dtype.newbyteorder("="))


def is_weak(given: Any) -> bool:
    """Whether the numbers are of no size, as Python's are: they become what is wanted."""
    return isinstance(given, (list, tuple, int, float))


def floats(given: Any, name: str, dtype: Any = None) -> np.ndarray:
    """float32 or float64, or `dtype` if given; without a copy if the array already has that type. Whole
    numbers are taken if they stay what they are: as `dtype`, or as float64."""
    weak = is_weak(given)
    out = array(given)
    if out.dtype.kind in "iu":
        exact = _exact_floats(out, name, np.dtype(np.float64 if weak or dtype is None else dtype))
        return exact if dtype is None else exact.astype(dtype, copy=False)
    if out.dtype.kind != "f" or out.dtype.itemsize not in (4, 8):
        if out.dtype.kind not in "fb":
            raise Error(f"{name} has the dtype {out.dtype}, from {type(given).__name__}: it must be an array of float32 or float64")
        raise Error(f"{name} has the dtype {out.dtype}: it must be float32 or float64, as "
                    f"{name}.astype(numpy.float64) is")
    if dtype is not None and out.dtype != dtype:
        if not weak and np.dtype(dtype).itemsize < out.dtype.itemsize:
            raise Error(f"{name} is {out.dtype} and would have to be rounded to {np.dtype(dtype)}: "
                        f"say so with {name}.astype(numpy.{np.dtype(dtype)})")
        out = out.astype(dtype)
    return out


def _exact_floats(whole: np.ndarray, name: str, dtype: np.dtype) -> np.ndarray:
    """Whole numbers as floats of a dtype, none of them rounded."""
    out = whole.astype(dtype)
    limits = np.iinfo(whole.dtype)
    most = 2**(np.finfo(dtype).nmant + 1)  # up to here there are all whole numbers
    if max(-int(limits.min), int(limits.max)) <= most or -most <= int(whole.min(initial=0)) and int(whole.max(initial=0)) <= most:
        return out
    # The greatest number rounds to one that is no whole number of its dtype any more: it can't be taken back.
    beyond = out >= 2.0**limits.bits if limits.min == 0 else out >= 2.0**(limits.bits - 1)
    wrong = beyond | (np.where(beyond, 0, out).astype(whole.dtype) != whole)
    if wrong.any():
        place = tuple(int(i) for i in np.argwhere(wrong)[0])
        where = f"[{', '.join(map(str, place))}]" if place else ""
        raise Error(f"{name}{where} is {whole[place]}, which {dtype} can't hold exactly: round it with "
                    f"{name}.astype(numpy.{dtype}), or subtract an origin first", place[0] if place else None)
    return out


def numbers(given: Any, name: str) -> np.ndarray:
    """Real numbers of any dtype, as float64."""
    out = array(given)
    if out.dtype.kind not in "iufb":
        raise Error(f"{name} has the dtype {out.dtype}, from {type(given).__name__}: it must be one number, or an array of them")
    return out.astype(np.float64, copy=False)


def boxes(given: Any, name: str = "boxes", dtype: Any = None) -> np.ndarray:
    """Boxes, read in place."""
    out = floats(given, name, dtype)
    size = out.dtype.itemsize
    if any(stride % size for stride in out.strides):
        out = np.ascontiguousarray(out)
    if out.size == 0 and out.ndim == 1:  # an empty list
        out = out.reshape(0, 2, 3)
    return out


def dim_of(boxes_array: np.ndarray, name: str = "boxes") -> int:
    """2 or 3."""
    if boxes_array.ndim == 3 and boxes_array.shape[1] == 2 and boxes_array.shape[2] in (2, 3):
        return int(boxes_array.shape[2])
    if boxes_array.ndim == 2 and boxes_array.shape[1] in (4, 6):
        return int(boxes_array.shape[1]) // 2
    points = boxes_array.ndim == 2 and boxes_array.shape[1] in (2, 3)
    raise Error(f"{name} has the shape {boxes_array.shape}: it must be (n, 2, d) or (n, 2 d), with d 2 or 3, lower "
                "bounds before upper ones" + ("; points are boxes as numpy.stack([points, points], axis=1)" if points else ""))


def rows(given: Any, name: str, dtype: Any = None) -> np.ndarray:
    """Packed rows of numbers."""
    return np.ascontiguousarray(floats(given, name, dtype))


def integers(given: Any, name: str, dtype: Any) -> np.ndarray:
    """Whole numbers of this dtype, checked rather than wrapped around; without a copy if they already have it."""
    out = array(given)
    if is_weak(given) and out.dtype.kind == "f":
        out = _whole_numbers(given, out, dtype)
    if out.dtype == dtype:
        return out
    if out.dtype.kind == "b":
        raise Error(f"{name} has the dtype bool: it must be whole numbers, as numpy.flatnonzero({name}) is")
    if out.dtype.kind not in "iu":
        raise Error(f"{name} has the dtype {out.dtype}: it must be whole numbers")
    limits = np.iinfo(dtype)
    if out.size:
        wrong = (out < limits.min) | (out > limits.max) if out.dtype.kind == "i" else out > limits.max
        if wrong.any():
            place = tuple(int(i) for i in np.argwhere(wrong)[0])
            where = f"[{', '.join(map(str, place))}]" if place else ""
            raise Error(f"{name}{where} is {out[place]}, and must be from {limits.min} to {limits.max}", place[0] if place else None)
    return out.astype(dtype)


def _whole_numbers(given: Any, rounded: np.ndarray, dtype: Any) -> np.ndarray:
    """Python's whole numbers, which NumPy has rounded: of an empty list, and of one with numbers from 2**63 on and lesser ones."""
    exact = np.asarray(given, object)
    limits = np.iinfo(dtype)
    fit = all(isinstance(one, (int, np.integer)) and limits.min <= one <= limits.max for one in exact.flat)
    return exact.astype(dtype) if fit else rounded


def optional_integers(given: Any, name: str) -> np.ndarray | None:
    return None if given is None else integers(given, name, np.uint32)


def packed(given: Any, name: str, dtype: Any) -> np.ndarray:
    return np.ascontiguousarray(integers(given, name, dtype))


def whole(given: Any, name: str, end: int = 2**32) -> int:
    """A whole number from 0 up to `end`."""
    try:
        number = operator.index(given if isinstance(given, int) else array(given).tolist())
    except (TypeError, ValueError):
        raise Error(f"{name} is {given!r}: it must be a whole number") from None
    if not 0 <= number < end:
        raise Error(f"{name} is {number}: it must be from 0 to {end - 1}")
    return number


def threads(given: Any, accept: Any = None) -> int:
    """How many threads. A function in Python is called on one: several would mostly wait for each other."""
    number = whole(given, "threads")
    if number > 1024:
        raise Error(f"threads is {number}: it must be from 0 to 1024")
    return number if accept is None else 1


def function(given: Any, name: str) -> Any:
    if given is not None and not callable(given):
        raise Error(f"{name} is {given!r}: it must be a function, or None")
    return given


def flags(given: Any, name: str, count: int) -> np.ndarray:
    """What is so of each of `count` objects, or of all: truth values, or 0 and 1."""
    out = array(given)
    if out.dtype.kind not in "biu" or out.size and not np.isin(out, (0, 1)).all():
        raise Error(f"{name} is {given!r}: it must be True or False, or one of these for each object")
    return per_object(out.astype(np.uint8), name, count)


def per_object(given: np.ndarray, name: str, count: int) -> np.ndarray:
    """One for each of `count` objects, where there may be one for all."""
    if given.shape not in ((), (1,), (count,)):
        raise Error(f"{name} has the shape {given.shape}, and there are {count} objects: give one for all, or one for each",
                    None, "size_mismatch")
    return np.require(np.broadcast_to(given, (count,)), requirements=["C", "A"])


def ids(given: Any, name: str = "ids") -> np.ndarray:
    """Ids of a world; a single id is a batch of one."""
    return np.atleast_1d(packed(given if not isinstance(given, int) else [given], name, np.uint64))


def id_pairs(given: Any, name: str) -> np.ndarray:
    """Pairs of ids of a world."""
    out = packed(given, name, np.uint64)
    return out.reshape(0, 2) if out.size == 0 else out


def pairs(given: Any) -> np.ndarray:
    out = packed(given, "pairs", np.uint32)
    return out.reshape(0, 2) if out.size == 0 else out


def packed_poses(given: Any, dtype: Any) -> np.ndarray:
    """Rows of numbers, each packed."""
    out = floats(given, "poses", dtype)
    good = out.ndim == 2 and out.strides[1] == out.itemsize and out.strides[0] % out.itemsize == 0
    return out if good else np.ascontiguousarray(out)


def rows_dtype(dim: int, number: Any, names: tuple[str, ...]) -> np.dtype:
    return np.dtype([(names[0], number)] + [(name, number, (dim,)) for name in names[1:]])


def hits_dtype(dim: int, number: Any) -> np.dtype:
    return np.dtype([("fraction", number), ("normal", number, (dim,)), ("point", number, (dim,)), ("part", np.uint32),
                     ("moving_part", np.uint32)], align=True)


def table(title: str, values: dict[str, Any]) -> str:
    """Numbers by name, as a notebook shows them."""
    lines = "".join(f"<tr><th>{name}</th><td style='text-align:right'>{value:,}</td></tr>" for name, value in values.items()
                    if value)
    return f"<table><caption>{title}</caption>{lines}</table>"
