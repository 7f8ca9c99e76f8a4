# SPDX-License-Identifier: MIT
"""Overlapping detections: boxes that a detector found in images, many of them the same thing. Keeps the best of each class
(non-maximum suppression), and matches what is left with what is really there, without comparing all with all."""
import time

import numpy as np

import jostle


def iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union, row by row, of boxes as x0, y0, x1, y1."""
    common = np.prod(np.clip(np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2]), 0, None), axis=1)
    area = lambda box: (box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1])
    return common / np.maximum(area(a) + area(b) - common, np.float32(1e-30))


def suppressed(boxes: np.ndarray, scores: np.ndarray, classes: np.ndarray, threshold: float) -> np.ndarray:
    """The positions that greedy non-maximum suppression keeps, best first: a box goes if a better one of its class that is
    kept overlaps it by more than the threshold; of equal scores the first box is the better."""
    pairs = jostle.find_pairs(boxes)
    pairs = pairs[classes[pairs[:, 0]] == classes[pairs[:, 1]]]
    pairs = pairs[iou(boxes[pairs[:, 0]], boxes[pairs[:, 1]]) > threshold]
    first = scores[pairs[:, 0]] >= scores[pairs[:, 1]]
    better, worse = np.where(first, pairs[:, 0], pairs[:, 1]), np.where(first, pairs[:, 1], pairs[:, 0])
    kept, gone = np.zeros(len(boxes), bool), np.zeros(len(boxes), bool)
    while True:  # boxes without a better one left are kept, and what they beat goes: a few rounds
        waits = np.zeros(len(boxes), bool)
        waits[worse] = True
        kept |= ~waits & ~gone
        gone[worse[kept[better]]] = True
        left = ~gone[better] & ~gone[worse]
        better, worse = better[left], worse[left]
        if not len(worse):
            break
    kept = np.flatnonzero(kept | ~gone)
    return kept[np.argsort(-scores[kept], kind="stable")]


def matched(found: np.ndarray, truth: np.ndarray, threshold: float) -> np.ndarray:
    """For each found box, best first, the true one that it overlaps most and no earlier one took; -1 for none."""
    pairs = jostle.find_pairs(found, truth)
    overlap = iou(found[pairs[:, 0]], truth[pairs[:, 1]])
    pairs, overlap = pairs[overlap > threshold], overlap[overlap > threshold]
    order = np.lexsort((pairs[:, 1], -overlap, pairs[:, 0]))
    match, taken = np.full(len(found), -1), np.zeros(len(truth), bool)
    for a, b in pairs[order].tolist():
        if match[a] < 0 and not taken[b]:
            match[a], taken[b] = b, True
    return match


def detections(things: int, each: int, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    centers = rng.random((things, 2)) * size
    truth = np.concatenate([centers - 20, centers + 20], axis=1).astype(np.float32)
    boxes = np.repeat(truth, each, axis=0) + rng.normal(0, 3, (things * each, 4)).astype(np.float32)
    classes = np.repeat(rng.integers(0, 10, things), each)
    return truth, boxes, rng.random(len(boxes)), classes


if __name__ == "__main__":
    # By the definition, on few: each box against all that are better.
    truth, boxes, scores, classes = detections(100, 8, 700)
    right: list[int] = []
    for i in np.argsort(-scores, kind="stable").tolist():
        same = [k for k in right if classes[k] == classes[i]]
        if not (iou(boxes[same], np.repeat(boxes[[i]], len(same), axis=0)) > 0.5).any():
            right.append(i)
    assert suppressed(boxes, scores, classes, 0.5).tolist() == right

    truth, boxes, scores, classes = detections(4125, 8, 8000)
    start = time.perf_counter()
    kept = suppressed(boxes, scores, classes, 0.5)
    match = matched(boxes[kept], truth, 0.5)
    ms = (time.perf_counter() - start) * 1e3
    print(f"{len(boxes)} detections of {len(truth)} things: {len(kept)} kept, {(match >= 0).sum()} of them matched, in {ms:.1f} ms")
    assert (match >= 0).sum() > 0.9 * len(truth)
