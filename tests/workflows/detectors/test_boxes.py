"""Laws of boxes, their overlap and non-maximum suppression."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from isethdr_workflows.detectors.boxes import Detections, areas, corners, overlaps, suppressed


def drawn(seed: int, count: int) -> Detections:
    """Return boxes of two classes in a picture of 100 x 100 pixels."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 90, (count, 2))
    boxes = np.concatenate([low, low + rng.uniform(1, 40, (count, 2))], 1)
    return Detections(boxes, rng.random(count), rng.integers(0, 2, count))


def test_all_forms_name_the_same_box():
    box = np.array([[10.0, 20.0, 14.0, 30.0]])
    for form, numbers in (
        ("xyxy", [10, 20, 14, 30]),
        ("xywh", [10, 20, 4, 10]),
        ("cxcywh", [12, 25, 4, 10]),
    ):
        np.testing.assert_array_equal(corners(np.array([numbers], float), form), box)


def test_overlaps_of_boxes_that_one_can_count():
    one = np.array([[0.0, 0, 2, 2]])
    others = np.array([[0.0, 0, 2, 2], [1, 1, 3, 3], [2, 0, 4, 2], [0, 0, 0, 5], [3, 3, 1, 1]])
    np.testing.assert_allclose(overlaps(one, others)[0], [1, 1 / 7, 0, 0, 0], rtol=1e-15)
    np.testing.assert_array_equal(areas(others), [4, 4, 4, 0, 0])


@settings(max_examples=30, deadline=None)
@given(seed=some.integers(0, 10_000), count=some.integers(0, 40), overlap=some.floats(0.05, 0.95))
def test_what_stays_is_apart_and_what_goes_had_a_better_one(seed, count, overlap):
    found = drawn(seed, count)
    kept = suppressed(found, overlap, 100)
    assert (np.diff(kept.scores) <= 0).all()
    shared = overlaps(kept.boxes, kept.boxes)
    same = kept.classes[:, None] == kept.classes
    np.fill_diagonal(same, False)
    assert not (same & (shared > overlap)).any()
    stays = {tuple(box) for box in kept.boxes}
    for box, score, kind in zip(found.boxes, found.scores, found.classes):
        if tuple(box) not in stays:
            better = (kept.scores >= score) & (kept.classes == kind)
            assert (overlaps(box[None], kept.boxes[better])[0] > overlap).any()


@settings(max_examples=20, deadline=None)
@given(seed=some.integers(0, 10_000))
def test_suppressing_twice_changes_nothing_and_order_does_not_matter(seed):
    found = drawn(seed, 30)
    once = suppressed(found, 0.4, 100)
    twice = suppressed(once, 0.4, 100)
    np.testing.assert_array_equal(once.boxes, twice.boxes)
    order = np.random.default_rng(seed).permutation(30)
    mixed = Detections(found.boxes[order], found.scores[order], found.classes[order])
    np.testing.assert_array_equal(suppressed(mixed, 0.4, 100).boxes, once.boxes)


def test_an_overlap_of_one_keeps_all_and_most_keeps_the_best():
    found = drawn(3, 20)
    assert len(suppressed(found, 1.0, 100).scores) == 20
    best = suppressed(found, 1.0, 4)
    np.testing.assert_array_equal(best.scores, np.sort(found.scores)[::-1][:4])


@pytest.mark.parametrize("count", [0, 1])
def test_few_boxes_stay_as_they_are(count):
    assert len(suppressed(drawn(0, count), 0.5, 10).scores) == count
