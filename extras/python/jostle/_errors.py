# SPDX-License-Identifier: MIT
"""What calls raise."""
from __future__ import annotations


class Error(ValueError):
    """What was wrong with the data that a call was given. The message names the object and the value.

    index    the lowest object at fault, or None where no single object is
    status   which kind of mistake: "nan_coordinate", "inverted_box", "size_mismatch", ...
    """

    def __init__(self, message: str, index: int | None = None, status: str = "invalid_argument") -> None:
        super().__init__(message)
        self.index = index
        self.status = status

    def __reduce__(self) -> tuple[type[Error], tuple[str, int | None, str]]:
        return type(self), (str(self), self.index, self.status)


class StaleIdError(Error, IndexError):
    """An id that names no object of the world: an IndexError as well as a ValueError."""


class NoSuchObjectError(Error, IndexError):
    """A pair, or another argument, that names an object which doesn't exist: an IndexError as well as a ValueError."""


def make(status: str, message: str, index: int | None) -> Error:
    """Called by the compiled part."""
    if status == "stale_id":
        return StaleIdError(message, index, status)
    return Error(message, index, status)
