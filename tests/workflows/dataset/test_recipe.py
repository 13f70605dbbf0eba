"""Recipes: what is read, what is refused, and what is drawn."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_workflows.dataset.draw import drawn_scene, family_of, overrides_to_try
from isethdr_workflows.dataset.recipe import Choice, LogUniform, Uniform, parsed, read_recipe
from scipy.stats import chisquare, kstest

from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import chain

TWO = """
about: Two families.
families:
  wet:
    share: 3
    overrides: [scene=night_drive]
    draw:
      scene.road_surface: {choice: {damp: 3, c2w3: 1}}
      scene.camera_height_m: {uniform: [1.1, 1.6]}
  tunnel:
    overrides: [scene=tunnel, lighting=tunnel]
"""


def test_shares_sum_to_one_and_a_family_without_one_has_weight_one():
    recipe = parsed(TWO, "two")
    assert [(f.name, f.share) for f in recipe.families] == [("wet", 0.75), ("tunnel", 0.25)]
    assert recipe.families[0].draw["scene.road_surface"] == Choice(("damp", "c2w3"), (0.75, 0.25))
    assert recipe.splits == {"train": 0.7, "validation": 0.15, "test": 0.15}


def test_a_value_that_a_list_names_twice_has_twice_the_share():
    recipe = parsed("families: {a: {draw: {k: {choice: [dry, dry, damp, null]}}}}", "mine")
    assert recipe.families[0].draw["k"] == Choice(("dry", "damp", "null"), (0.5, 0.25, 0.25))


def test_a_recipe_in_another_encoding_is_one_error(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_bytes("about: Straße".encode("latin-1"))
    with pytest.raises(ConfigError, match="no text in UTF-8"):
        read_recipe(str(path))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("families: [", "no valid YAML"),
        ("just a line", "no table of keys"),
        ("families: {}", "families: {} is no table"),
        ("familys: {a: {}}", "did you mean 'families'"),
        ("families: {a: {shares: 2}}", "did you mean 'share'"),
        ("families: {a: {share: 0}}", "expected a positive number for each name"),
        ("families: {a: {share: .nan}}", "expected a positive number for each name"),
        ("families: {a: {share: 1, overrides: scene=tunnel}}", "expected a list of overrides"),
        ("families: {a: {share: 1, draw: {k: 3}}}", "family a: k is 3; expected {choice"),
        ("families: {a: {share: 1, draw: {k: {uniform: [2, 1]}}}}", "{uniform: [least, most]}"),
        ("families: {a: {share: 1, draw: {k: {log_uniform: [0, 1]}}}}", "least above 0"),
        ("families: {a: {share: 1, draw: {k: {choice: {b: -1}}}}}", "expected a positive number"),
        ("families: {a: {share: 1, draw: {k: {choice: []}}}}", "expected {choice"),
        ("families: {a: {share: 1, draw: {k: {choice: 5}}}}", "expected {choice"),
        ("families: {a: {share: 1, draw: {k: {choice: night}}}}", "expected {choice"),
        ("families: {a: {share: 1, draw: {k: {choice: [[0, 1], [1, 0]]}}}}", "expected {choice"),
    ],
)
def test_a_mistake_is_one_error_that_names_its_place(text, said):
    with pytest.raises(ConfigError) as error:
        parsed(text, "mine")
    assert said in str(error.value)
    assert str(error.value).startswith("recipe mine")


def test_overrides_of_the_recipe_come_before_those_of_its_families():
    families = parsed(
        "overrides: [a=1]\nfamilies: {x: {overrides: [a=2]}, y: {share: 1}}", "two"
    ).families
    assert [family.overrides for family in families] == [("a=1", "a=2"), ("a=1",)]
    with pytest.raises(ConfigError, match="recipe one: overrides are 'a=1'"):
        parsed("overrides: a=1\nfamilies: {x: {share: 1}}", "one")


def test_a_recipe_that_does_not_exist_names_those_that_do(tmp_path):
    with pytest.raises(ConfigError, match=r"did you mean 'roads'.*recipe=roads"):
        read_recipe("road")
    with pytest.raises(ConfigError, match="there is no recipe"):
        read_recipe(str(tmp_path / "none.yaml"))


def test_a_scene_depends_on_seed_and_number_alone():
    recipe = parsed(TWO, "two")
    first = [drawn_scene(recipe, 5, number) for number in range(40)]
    assert first == [drawn_scene(recipe, 5, number) for number in range(60)][:40]
    other = [drawn_scene(recipe, 6, number) for number in range(40)]
    assert not {scene.road for scene in first} & {scene.road for scene in other}
    assert len({scene.road for scene in first}) == 40


def test_families_of_any_first_scenes_have_their_shares():
    """Families are chosen by golden-ratio steps. The counts among the first n scenes are within 2
    of their shares for every n up to 300. Independent draws would differ by more than 7 of 300 in
    one case of three.
    """
    recipe = parsed(TWO, "two")
    for seed in range(5):
        wet = np.cumsum([family_of(recipe, seed, k).name == "wet" for k in range(300)])
        assert np.abs(wet - 0.75 * np.arange(1, 301)).max() < 2.0


def test_values_follow_their_distributions():
    """Chi-square and Kolmogorov-Smirnov tests with fixed seeds; a wrong share of 0.05 would have
    p < 1e-9.
    """
    random = np.random.default_rng(2)
    choice = Choice(("a", "b", "c"), (0.5, 0.3, 0.2))
    drawn = [choice.drawn(random) for _ in range(4000)]
    counts = [drawn.count(value) for value in choice.values]
    assert chisquare(counts, 4000 * np.array(choice.shares)).pvalue > 1e-3
    even = [float(Uniform(2.0, 6.0).drawn(random)) for _ in range(2000)]
    assert kstest(even, "uniform", (2.0, 4.0)).pvalue > 1e-3
    logs = [np.log(float(LogUniform(0.01, 100.0).drawn(random))) for _ in range(2000)]
    assert kstest(logs, "uniform", (np.log(0.01), np.log(1e4))).pvalue > 1e-3


def test_every_choice_and_every_limit_is_tried_once():
    tried = overrides_to_try(parsed(TWO, "two"))
    assert len(tried) == 4
    values = {override for _, overrides in tried for override in overrides}
    assert {f"scene.road_surface={name}" for name in ("damp", "c2w3")} <= values
    assert {"scene.camera_height_m=1.1", "scene.camera_height_m=1.6"} <= values


def test_the_bundled_recipe_composes():
    recipe = read_recipe("roads")
    for family in recipe.families:
        first = next(o for name, o in overrides_to_try(recipe) if name == family.name)
        assert chain(compose(first)).renderer is not None


def test_the_recipe_of_weather_draws_mounts_and_fog_and_composes():
    recipe = read_recipe("weather")
    drawn = [drawn_scene(recipe, 1, number) for number in range(60)]
    values = {override for scene in drawn for override in scene.overrides}
    assert {f"scene.camera_mount={mount}" for mount in ("front", "rear", "left", "right")} <= values
    fog = [o.partition("=")[2] for o in values if o.startswith("scene.visibility_m=")]
    assert len(fog) > 10 and all(40 <= float(visibility_m) <= 1000 for visibility_m in fog)
    for family in ("sun", "fog_by_night"):
        first = next(o for name, o in overrides_to_try(recipe) if name == family)
        scene = chain(compose(first)).scene
        assert (scene.visibility_m is None) == (family == "sun")
        assert scene.sky == ("noon" if family == "sun" else "uniform")


@pytest.mark.slow
def test_every_choice_of_the_recipe_of_weather_composes():
    for _, overrides in overrides_to_try(read_recipe("weather")):
        assert chain(compose(overrides)).renderer is not None


@pytest.mark.slow
def test_two_hundred_scenes_of_the_bundled_recipe_can_be_placed():
    recipe = read_recipe("roads")
    for number in range(200):
        chain(compose(drawn_scene(recipe, 1, number).overrides)).scene.plan()
