"""Synthetic pictures for detectors: noisy squares on grey, one colour for each class."""

from __future__ import annotations

import numpy as np
from isethdr_workflows.training.detector.pictures import Data, LabelledPicture

COLOURS = ((230, 40, 40), (40, 230, 40), (60, 60, 240), (230, 220, 40), (220, 60, 220))
WIDTH = 128
HEIGHT = 96
ASKED_PX = 8


def drawn(seed: int, road: str) -> LabelledPicture:
    """Return a grey picture with noise and one to four squares that do not touch."""
    random = np.random.default_rng(seed)
    rgb = random.normal(90, 12, (HEIGHT, WIDTH, 3))
    boxes = []
    classes = []
    for column in random.permutation(4)[: random.integers(1, 5)]:
        side = int(random.integers(10, 26))
        left = int(column * 32 + random.integers(0, 32 - side + 1))
        top = int(random.integers(0, HEIGHT - side + 1))
        kind = int(random.integers(len(COLOURS)))
        shade = np.array(COLOURS[kind]) * random.uniform(0.8, 1.0)
        rgb[top : top + side, left : left + side] = shade + random.normal(0, 8, (side, side, 3))
        boxes.append((left, top, left + side, top + side))
        classes.append(kind)
    return LabelledPicture(
        np.clip(rgb, 0, 255).astype(np.uint8),
        np.array(boxes, float),
        np.array(classes),
        np.ones(len(boxes), bool),
        road,
    )


def drawn_data(count: int) -> Data:
    """Return `count` pictures for training, and a quarter as many held-out ones of other roads."""
    training = [drawn(k, f"road-{k}") for k in range(count)]
    held_out = [drawn(10_000 + k, f"held-{k}") for k in range(count // 4)]
    return Data(training, held_out, "drawn squares")
