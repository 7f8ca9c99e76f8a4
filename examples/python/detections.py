# SPDX-License-Identifier: MIT
"""Overlapping detections: boxes that a detector found in images, many of them the same thing. Keeps the best of each class
(non-maximum suppression), and matches what is left with what is really there, without comparing all with all."""
import time

import numpy as np

import jostle


def overlapping(a: np.ndarray, b: np.ndarray, pairs: np.ndarray, threshold: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pairs of boxes of a and b, as x0, y0, x1, y1, whose intersection over union is above the threshold: the first, the second,
    and how much. In blocks that stay in the cache, and corners taken as one number of x and y each."""
    def corners(boxes: np.ndarray) -> list[np.ndarray]:
        return [np.ascontiguousarray(half).view(np.complex64 if boxes.dtype == np.float32 else np.complex128)[:, 0]
                for half in (boxes[:, :2], boxes[:, 2:])]

    def area(boxes: np.ndarray) -> np.ndarray:
        return (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])

    (low, high), area_a = corners(a), area(a)
    (low_b, high_b), area_b = ((low, high), area_a) if b is a else (corners(b), area(b))
    found = [(np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0, a.dtype))]
    for block in range(0, len(pairs), 8192):
        i, k = np.ascontiguousarray(pairs[block:block + 8192].T, np.intp)  # take() is fastest with these
        size = np.minimum(high.take(i).view(a.dtype), high_b.take(k).view(a.dtype))
        size -= np.maximum(low.take(i).view(a.dtype), low_b.take(k).view(a.dtype))
        common = size[::2] * size[1::2]  # they touch: neither is below 0
        common /= np.maximum(area_a.take(i) + area_b.take(k) - common, a.dtype.type(1e-30))
        above = common > threshold
        found.append((i[above], k[above], common[above]))
    i, k, overlap = (np.concatenate(column) for column in zip(*found))
    return i, k, overlap


def suppressed(boxes: np.ndarray, scores: np.ndarray, classes: np.ndarray, threshold: float) -> np.ndarray:
    """The positions that greedy non-maximum suppression keeps, best first: a box goes if a better one of its class that is
    kept overlaps it by more than the threshold; of equal scores the first box is the better."""
    bits = np.uint32(1) << (classes % 32).astype(np.uint32)  # so most pairs of different classes aren't even found
    pairs = jostle.find_pairs(boxes, category=bits, mask=bits)
    if classes.max(initial=0) >= 32:
        pairs = pairs[classes[pairs[:, 0]] == classes[pairs[:, 1]]]
    i, k, _ = overlapping(boxes, boxes, pairs, threshold)
    score, other = scores.take(i), scores.take(k)
    step = (k - i) * ((score < other) | ((score == other) & (i > k)))  # as np.where, which guesses wrongly what comes next
    better, worse = i + step, k - step
    gone = np.zeros(len(boxes), bool)
    while len(worse):  # a box without a better one left is kept, and what it beats goes: a few rounds
        waits = np.zeros(len(boxes), bool)
        waits[worse] = True
        gone[worse[~waits.take(better)]] = True
        left = ~(gone.take(better) | gone.take(worse))
        better, worse = better[left], worse[left]
    kept = np.flatnonzero(~gone)
    return kept[np.argsort(-scores[kept], kind="stable")]


def matched(found: np.ndarray, truth: np.ndarray, threshold: float) -> np.ndarray:
    """For each found box, best first, the true one that it overlaps most and no earlier one took; -1 for none."""
    i, k, overlap = overlapping(found, truth, jostle.find_pairs(found, truth), threshold)
    match = np.full(len(found), -1)
    alone = (np.bincount(i, minlength=len(found)).take(i) == 1) & (np.bincount(k, minlength=len(truth)).take(k) == 1)
    match[i[alone]] = k[alone]  # most have one candidate, who has no other
    i, k, overlap = i[~alone], k[~alone], overlap[~alone]
    taken = np.zeros(len(truth), bool)
    order = np.lexsort((k, -overlap, i))
    for box, thing in zip(i[order].tolist(), k[order].tolist()):
        if match[box] < 0 and not taken[thing]:
            match[box], taken[thing] = thing, True
    return match


def detections(things: int, each: int, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    centers = rng.random((things, 2)) * size
    truth = np.concatenate([centers - 20, centers + 20], axis=1).astype(np.float32)
    boxes = np.repeat(truth, each, axis=0) + rng.normal(0, 3, (things * each, 4)).astype(np.float32)
    classes = np.repeat(rng.integers(0, 10, things), each)
    return truth, boxes, rng.random(len(boxes)), classes


# The same by the definition, each box against all that are better.

def iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of all boxes with all: (n, m)."""
    common = np.prod(np.clip(np.minimum(a[:, None, 2:], b[None, :, 2:]) - np.maximum(a[:, None, :2], b[None, :, :2]), 0, None), axis=2)
    area = lambda box: (box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1])
    return common / np.maximum(area(a)[:, None] + area(b)[None] - common, np.float32(1e-30))


def suppressed_slowly(boxes: np.ndarray, scores: np.ndarray, classes: np.ndarray, threshold: float) -> list[int]:
    overlap, kept = iou(boxes, boxes), []
    for i in np.argsort(-scores, kind="stable").tolist():
        if not any(classes[k] == classes[i] and overlap[k, i] > threshold for k in kept):
            kept.append(i)
    return kept


def matched_slowly(found: np.ndarray, truth: np.ndarray, threshold: float) -> list[int]:
    overlap, match = iou(found, truth), []
    for row in overlap:
        free = [k for k in range(len(truth)) if row[k] > threshold and k not in match]
        match.append(max(free, key=lambda k: row[k], default=-1))
    return match


if __name__ == "__main__":
    rng = np.random.default_rng(2)
    for seed in range(8):
        truth, boxes, scores, classes = detections(25, 8, 250)
        if seed % 2:  # equal scores, many classes, and boxes of other sizes, some without area
            scores, classes = scores.round(1), rng.integers(0, 100, len(boxes)) * rng.integers(0, 2)
            boxes[:, 2:] = boxes[:, :2] + np.abs(rng.normal(30, 20, (len(boxes), 2))).round(-1)
        kept = suppressed(boxes, scores, classes, 0.3)
        assert kept.tolist() == suppressed_slowly(boxes, scores, classes, 0.3)
        assert matched(boxes[kept], truth, 0.3).tolist() == matched_slowly(boxes[kept], truth, 0.3)

    truth, boxes, scores, classes = detections(4125, 8, 8000)
    times = []
    for _ in range(5):  # the first call also starts threads
        start = time.perf_counter()
        kept = suppressed(boxes, scores, classes, 0.5)
        match = matched(boxes[kept], truth, 0.5)
        times.append((time.perf_counter() - start) * 1e3)
    print(f"{len(boxes)} detections of {len(truth)} things: {len(kept)} kept, {(match >= 0).sum()} of them matched, in {min(times):.1f} ms")
    assert (match >= 0).sum() > 0.9 * len(truth)
