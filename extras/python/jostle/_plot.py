# SPDX-License-Identifier: MIT
"""A picture of boxes and pairs."""
from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays
from ._errors import Error, NoSuchObjectError


def plot(boxes: Any, pairs: Any = None, *, ax: Any = None, axes: tuple[int, int] = (0, 1)) -> Any:
    """Draws boxes, and lines between the centres of pairs, with matplotlib. 3D boxes are drawn as seen along the axis that isn't
    in `axes`. Boxes in a pair are darker. Returns matplotlib's Axes."""
    from matplotlib import pyplot
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Rectangle

    given = _arrays.boxes(boxes)
    dim = _arrays.dim_of(given)
    if any(axis not in range(dim) for axis in axes):
        raise Error(f"axes is {axes}: the boxes have the axes 0 to {dim - 1}")
    at = given.reshape(-1, 2, dim)[:, :, list(axes)]
    if ax is None:
        ax = pyplot.gca()
    paired = np.zeros(len(at), bool)
    if pairs is not None and len(pairs):
        named = _arrays.pairs(pairs)
        if named.max() >= len(at):
            i = int(np.argmax((named >= len(at)).any(axis=1)))
            raise NoSuchObjectError(f"pairs[{i}] is {named[i].tolist()}, and there are {len(at)} boxes", i)
        paired[named.reshape(-1)] = True
        centers = at.mean(axis=1)
        ax.add_collection(LineCollection(centers[named], colors="tab:red", linewidths=0.8, zorder=3))
    for chosen, color in ((~paired, "#c7d3e6"), (paired, "#4a6fa5")):
        ax.add_collection(PatchCollection([Rectangle(tuple(lo), *(hi - lo)) for lo, hi in at[chosen]], facecolor=color,
                                          edgecolor="#22304a", alpha=0.5, linewidth=0.5))
    ax.autoscale_view()
    ax.set_aspect("equal")
    return ax
