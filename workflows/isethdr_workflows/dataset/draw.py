"""Draw: the settings of scene number k of a dataset.

A scene depends only on the seed of the dataset and on its own number. So a dataset of 60 scenes is
the beginning of one of 200 scenes, on any number of workers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .recipe import Family, Recipe

# steps of the golden ratio fill the unit interval evenly, so that the families of any first n
# scenes have nearly their shares (van der Corput's problem; Niederreiter 1992, chapter 3)
GOLDEN = (5**0.5 - 1) / 2
SEED = "scene.seed"


@dataclass(frozen=True)
class DrawnScene:
    """One scene of a dataset, before it is rendered."""

    number: int  # from 0
    family: str
    road: str  # scenes of one road stay in one split
    overrides: tuple[str, ...]


def drawn_scene(recipe: Recipe, seed: int, number: int) -> DrawnScene:
    """Return scene `number` of the dataset with seed `seed`.

    Parameters
    ----------
    recipe : families and distributions.
    seed : seed of the dataset, 0 or more.
    number : number of the scene, from 0.
    """
    family = family_of(recipe, seed, number)
    random = np.random.default_rng([seed, number, 1])
    scene_seed = int(random.integers(2**31))
    settings = [f"{key}={values.drawn(random)}" for key, values in sorted(family.draw.items())]
    return DrawnScene(
        number,
        family.name,
        f"{family.name}-{scene_seed}",
        (*family.overrides, *settings, f"{SEED}={scene_seed}"),
    )


def family_of(recipe: Recipe, seed: int, number: int) -> Family:
    """Return the family of a scene.

    Parameters
    ----------
    recipe, seed, number : as in `drawn_scene`.
    """
    start = np.random.default_rng([seed, 0]).random()
    place = (start + number * GOLDEN) % 1.0
    ends = np.cumsum([family.share for family in recipe.families])
    return recipe.families[min(int(np.searchsorted(ends, place)), len(recipe.families) - 1)]


def overrides_to_try(recipe: Recipe) -> list[tuple[str, tuple[str, ...]]]:
    """Return [(family, overrides)] that together hold every choice and every limit of a recipe.

    Each setting of a family is varied alone. This finds a wrong value without trying all
    combinations.
    """
    tried = []
    for family in recipe.families:
        first = {key: values.extremes()[0] for key, values in family.draw.items()}
        cases = [first]
        for key, values in family.draw.items():
            cases += [first | {key: value} for value in values.extremes()[1:]]
        for case in cases:
            settings = [f"{key}={value}" for key, value in case.items()]
            tried.append((family.name, (*family.overrides, *settings, f"{SEED}=0")))
    return tried
