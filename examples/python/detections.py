# SPDX-License-Identifier: MIT
"""Overlapping detections: boxes that a detector found in an image, many of them the same thing. Keeps the best of each
(non-maximum suppression), without comparing all with all."""
import numpy as np

import jostle

rng = np.random.default_rng(1)
things = rng.random((500, 2)) * 4000
centers = np.repeat(things, 8, axis=0) + rng.normal(0, 3, (4000, 2))  # eight detections of each thing
boxes = np.stack([centers - 20, centers + 20], axis=1).astype(np.float32)
scores = rng.random(4000)


def overlap(pairs: np.ndarray) -> np.ndarray:
    """Intersection over union of each pair."""
    a, b = boxes[pairs[:, 0]], boxes[pairs[:, 1]]
    common = np.prod(np.minimum(a[:, 1], b[:, 1]) - np.maximum(a[:, 0], b[:, 0]), axis=1)
    area = lambda box: np.prod(box[:, 1] - box[:, 0], axis=1)
    return common / (area(a) + area(b) - common)


pairs = jostle.find_pairs(boxes)
same = pairs[overlap(pairs) > 0.5]
beaten = np.where(scores[same[:, 0]] < scores[same[:, 1]], same[:, 0], same[:, 1])
kept = np.setdiff1d(np.arange(4000), beaten)
print(f"{len(boxes)} detections, {len(pairs)} pairs of boxes that touch, {len(kept)} kept")
assert 400 < len(kept) < 1200
