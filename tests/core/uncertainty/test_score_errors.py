"""The effect of scene noise on scores: closed forms of a mean and of a mean square, over whole
pictures and parts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import xarray as xr

from isethdr_core.data import quantities
from isethdr_core.data.scores import Score
from isethdr_core.data.temporal_modulation import stacked, time_mean
from isethdr_core.display.display_view import white_cd_m2
from isethdr_core.errors import PluginError
from isethdr_core.physics.detector.temporal_modulation import Modulation
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.plugins.registry import build
from isethdr_core.truth import make_picture, truth
from isethdr_core.uncertainty import changed_scenes, score_errors, score_movements
from isethdr_core.uncertainty.changed_scenes import Pair, ScoredShot
from isethdr_core.uncertainty.render_noise import (
    HALF_DIFFERENCE,
    NOISE,
    direct_share,
    relative_halves,
    smoothing_change,
)
from isethdr_core.uncertainty.score_intervals import student_factor

# rows and columns of pictures; the large one is divided into parts
SMALL = (12, 16)
LARGE = (288, 300)
LEVEL = 100.0  # cd/m2


def uniform_shot(relative, tiles=SMALL):
    """Return the shot of a uniform field by a camera with three colours in every pixel.

    Parameters
    ----------
    relative : half of the relative difference of the half buffers, of each tile or of all.
    tiles : rows and columns, of tiles and pixels alike.
    """
    scene = build(
        "scene", "uniform", width=tiles[1], height=tiles[0], luminance_cd_m2=LEVEL, step_nm=50.0
    )().load()
    groups = [str(g) for g in scene.light_group.values]
    # luminance of the only group at weight 1
    level = quantities.tristimulus(build("lighting", "ideal")(scene)).xyz.values[..., 1]
    scene[HALF_DIFFERENCE] = ("light_group", "y", "x"), np.stack([relative * level] * len(groups))
    mixed = build("lighting", "weights", weights={groups[0]: 1.0})(scene)
    light = build(
        "lens",
        "ideal",
        f_number=2.0,
        focal_length_mm=3e-3 * tiles[1] / mixed.attrs["field_width"],
        falloff="none",
    )(mixed)
    blank = np.ones((*tiles, 3))
    grid = make_picture(
        blank,
        blank,
        np.ones(tiles, bool),
        light.x.values,
        light.y.values,
        focal_length_mm=light.attrs["focal_length_mm"],
        pitch_um=3.0,
    )
    true = truth(mixed, grid)

    def expose(changed):
        return true.assign(
            xyz=true.xyz.copy(
                data=true.xyz.values * (changed.values[3] / light.values[3])[..., None]
            )
        )

    return ScoredShot(true, true, None, [], light, mixed, scene, expose)


def stated(metrics, shot, **count):
    """Return {score: (rms error, label of its term)}."""
    scores = [s for metric in metrics for s in metric(shot.picture, shot.truth, shot.labels)]
    errors = score_errors.of_scores(replace(shot, scores=scores), metrics, **count)
    return {term.part: (term.value, term.label) for term in errors.terms}


class Mean:
    """The mean of a power of the luminance, in units of `LEVEL`."""

    def __init__(self, power=1):
        self.power = power

    def __call__(self, picture, truth, labels=None):
        y = picture["xyz"].values[..., 1] / LEVEL
        return [Score("mean", float((y**self.power).mean()), "")]


class PartMean(Mean):
    MEAN_OF_PARTS = True


class InOnePass(PartMean):
    """A metric whose `of_parts` returns the scores of one part only."""

    def of_parts(self, picture, truth, part):
        return [self(picture, truth)]


class WithoutName(PartMean):
    """A metric whose scores of parts have no name."""

    def __call__(self, picture, truth, labels=None):
        scores = super().__call__(picture, truth)
        return scores if picture.sizes["y"] == LARGE[0] else [replace(scores[0], metric="")]


class Writing(Mean):
    """A metric that writes into the picture, which the next metric scores as well."""

    def __call__(self, picture, truth, labels=None):
        scores = super().__call__(picture, truth)
        picture["xyz"].values[...] = 7.0
        return scores


@pytest.mark.parametrize(
    ("metric", "said"),
    [
        (InOnePass(), "of_parts of metric 'InOnePass' returned a list of 1; expected a list of 9"),
        (WithoutName(), "metric 'WithoutName' returned the score '', whose metric is ''"),
    ],
)
def test_scores_of_parts_are_checked_as_those_of_the_whole(metric, said):
    with pytest.raises(PluginError, match=said):
        stated([metric], uniform_shot(0.1, LARGE))


def test_no_metric_changes_a_changed_picture_for_the_next():
    shot = replace(uniform_shot(0.1), scores=Mean()(uniform_shot(0.1).picture, None))
    with pytest.raises(ValueError, match="read-only") as found:
        score_errors.of_scores(shot, [Writing(), Mean()])
    assert "in __call__ of metric 'Writing'" in found.value.__notes__


def test_a_mean_scatters_as_independent_tiles_do():
    error, said = stated([Mean()], uniform_shot(0.1), count=60)["mean"]
    # an rms of 60 draws is known to 9 %: three of these
    assert error == pytest.approx(0.1 / np.sqrt(np.prod(SMALL)), rel=0.27) and "60 changes" in said


def test_parts_tell_it_of_the_whole():
    error, said = stated([PartMean()], uniform_shot(0.1, LARGE))["mean"]
    # the scatter of six parts is known to 32 %: three of these
    assert (
        error == pytest.approx(0.1 / np.sqrt(np.prod(LARGE)), rel=0.96)
        and "6 parts" in said
        and "factor of 1.8" in said
    )


@pytest.mark.parametrize(("metric", "tiles"), [(Mean(2), SMALL), (PartMean(2), LARGE)])
def test_what_noise_adds_to_one_side_is_stated_too(metric, tiles):
    """The mean square of 1 + n with n of variance v is 1 + v: a shift that no number of tiles
    averages out.
    """
    error, said = stated([metric], uniform_shot(0.4, tiles), count=30)["mean"]
    # the mean shift scatters by 2 v^(1/2) over the root of the number of tiles and changes: 0.3 %
    # for the large picture, 7 % for the small one. Tolerances are at least three of these
    assert float(said.split("of it ")[1].split(" to")[0]) == pytest.approx(
        0.16, rel=0.03 if tiles is LARGE else 0.2
    )
    scatter = 0.0 if tiles is LARGE else 2 * 0.4 / np.sqrt(np.prod(tiles))
    assert error == pytest.approx(np.hypot(0.16, scatter), rel=0.05 if tiles is LARGE else 0.25)


def test_no_light_becomes_negative():
    """Half buffers may differ by more than the light itself, because of rounding and accumulation.
    The difference then counts as all of the light: each tile has twice its light or none.
    """
    error, _ = stated([Mean(2)], uniform_shot(5.0))["mean"]
    assert error == stated([Mean(2)], uniform_shot(1.0))["mean"][0]
    # the mean of the squares 0 and 4, minus 1; it scatters by 2 / sqrt(192 tiles)
    assert error == pytest.approx(1.0, rel=0.15)


def test_groups_weigh_as_in_the_light_and_a_single_pass_says_nothing():
    shot = uniform_shot(0.1)
    scene = shot.scene
    mixed = shot.mixed
    doubled = mixed.copy(data=mixed.values * 2)
    doubled.attrs["weights"] = {g: 2 * w for g, w in mixed.attrs["weights"].items()}
    np.testing.assert_allclose(
        relative_halves(scene, doubled), relative_halves(scene, mixed), rtol=1e-6
    )
    np.testing.assert_allclose(relative_halves(scene, mixed), 0.1, rtol=1e-6)  # float32
    assert (
        relative_halves(scene.assign({HALF_DIFFERENCE: scene[HALF_DIFFERENCE] * np.nan}), mixed)
        is None
    )
    assert relative_halves(scene.drop_vars(HALF_DIFFERENCE), mixed) is None


def test_noise_without_halves_leaves_scores_without_errors_and_says_so():
    shot = uniform_shot(0.1)
    scene = shot.scene
    for noisy, said in (
        (scene.drop_vars(HALF_DIFFERENCE), []),
        (
            scene.drop_vars(HALF_DIFFERENCE).assign({NOISE: scene[HALF_DIFFERENCE]}),
            ["renderer noise in scores"],
        ),
    ):
        found = score_errors.of_scores(replace(shot, scene=noisy), [Mean()])
        assert found.errors == {} and found.terms == ()
        assert [left.what for left in found.left_out] == said


def test_light_that_was_spread_stays():
    shot = uniform_shot(0.1)
    light = shot.light
    mixed = shot.mixed
    np.testing.assert_allclose(direct_share(light, mixed), 1.0, rtol=1e-6)  # float32
    veiled = light.copy(data=light.values * 4)
    np.testing.assert_allclose(direct_share(veiled, mixed), 0.25, rtol=1e-6)
    # a lens may lose direct light; the share is then at most 1
    assert (direct_share(light.copy(data=light.values / 2), mixed) == 1.0).all()
    straight, _ = stated([Mean()], shot)["mean"]
    # three quarters of the light are veil: the picture is four times as bright, and changes by as
    # much as before
    behind_veil = replace(shot, picture=shot.expose(veiled), light=veiled)
    assert stated([Mean()], behind_veil)["mean"][0] == pytest.approx(straight, rel=1e-4)


def test_photocurrent_is_as_straight_as_the_light_it_is_made_of():
    shot = uniform_shot(0.1)
    mixed = shot.mixed
    light = shot.light
    efficiency = np.stack(
        [np.linspace(0.1, 0.6, len(mixed.wavelength)), np.linspace(0.5, 0.0, len(mixed.wavelength))]
    )
    electrons = np.tensordot(
        efficiency * photons_per_energy(mixed.wavelength.values), light.values, 1
    )
    current = quantities.photocurrent(
        2 * electrons,
        ["a", "b"],
        light.x.values,
        light.y.values,
        mixed.wavelength.values,
        efficiency,
        **{k: v for k, v in light.attrs.items() if k != "units"},
    )
    np.testing.assert_allclose(direct_share(current, mixed), 0.5, rtol=1e-6)


def test_light_that_varies_in_time_changes_in_all_its_components():
    shot = uniform_shot(0.1)
    light = shot.light
    mixed = shot.mixed
    quarters = [light.copy(data=light.values * share) for share in (0.25, 0.75)]
    varying = stacked(["lamp", "sun"], [Modulation(100.0, 0.5, 0.0, 0.0), Modulation()], quarters)
    np.testing.assert_allclose(direct_share(varying, mixed), 1.0, rtol=1e-6)
    whole, _ = stated([Mean()], shot)["mean"]
    exposed = replace(shot, light=varying, expose=lambda light: shot.expose(time_mean(light)))
    changed, _ = stated([Mean()], exposed)["mean"]
    np.testing.assert_allclose(changed, whole, rtol=1e-4)  # float32


def test_parts_are_all_of_the_picture_three_of_them_have_some_of_every_row_and_column():
    parts = changed_scenes.parts_of(uniform_shot(0.1, LARGE).truth)
    across = changed_scenes.PARTS_ACROSS
    count = np.zeros(LARGE, int)
    for p in parts:
        count[np.ix_(p["y"], p["x"])] += 1
    assert (count == 1).all() and len(parts) == across**2
    for k in range(0, len(parts), across):
        three = parts[k : k + across]
        assert sorted(int(r) for p in three for r in p["y"]) == list(range(LARGE[0]))
        assert sorted(int(c) for p in three for c in p["x"]) == list(range(LARGE[1]))
    assert changed_scenes.parts_of(uniform_shot(0.1).truth) == []


def test_each_pixel_has_the_number_of_its_part():
    parts = changed_scenes.parts_of(uniform_shot(0.1, LARGE).truth)
    numbers = changed_scenes.numbers_of(parts)
    assert numbers.shape == LARGE
    for k, part in enumerate(parts):
        assert (numbers[np.ix_(part["y"], part["x"])] == k).all()


def test_one_exposure_shows_a_lot_in_some_parts_and_the_smoothed_scene_in_others():
    """With a linear camera without blur, the inferred parts equal those of an exposure."""
    noise = 0.2 * np.random.default_rng(3).standard_normal(SMALL)
    shot = uniform_shot(noise)
    scenes = changed_scenes.ChangedScenes(shot)
    smooth = np.arange(SMALL[1]) < 5 * np.ones((SMALL[0], 1))
    exposed = scenes.exposed_in_parts(0, smooth)
    for found, whole in ((exposed.by_lot, scenes.by_lot(0)), (exposed.smoothed, scenes.smoothed())):
        for name in ("picture", "truth"):
            # light is rounded to float32, 6e-8, and seven bands are summed
            np.testing.assert_allclose(
                getattr(found, name).xyz, getattr(whole, name).xyz, rtol=3e-6, err_msg=name
            )
    change = exposed.by_lot.picture.xyz.values[..., 1] / shot.picture.xyz.values[..., 1] - 1
    np.testing.assert_allclose(np.abs(change), np.abs(noise), rtol=1e-4, atol=1e-5)


def test_noise_of_a_dark_pixel_beside_a_rare_bright_tile_is_not_multiplied():
    """One path finds the mirror image of a lamp. Smoothing makes the dark tiles around it 1e4 times
    brighter. The mean of the picture changes as that of the reference picture, although the dark
    pixels hold noise of both signs and light that demosaicing spread there.
    """
    dark = np.full(LARGE, 1e-3)
    dark[100, 100] = 1e3  # in units of `LEVEL`
    halves = np.where(dark > 1, 0.999, 0.0001)
    shot = uniform_shot(halves, LARGE)
    scene = shot.scene.assign({HALF_DIFFERENCE: shot.scene[HALF_DIFFERENCE] * dark})
    mixed, light = (v.copy(data=v.values * dark) for v in (shot.mixed, shot.light))
    true = shot.truth.assign(xyz=shot.truth.xyz * dark[..., None])
    off = 0.02 * LEVEL * np.random.default_rng(6).standard_normal(LARGE)
    off[100, 101] = 1e2 * LEVEL
    seen = true.assign(xyz=true.xyz + off[..., None])
    shot = replace(shot, picture=seen, truth=true, light=light, mixed_radiance=mixed, scene=scene)
    exposed = changed_scenes.ChangedScenes(shot).exposed_in_parts(0, np.zeros(LARGE, bool))
    changes = [
        after.xyz.values[..., 1] - before.xyz.values[..., 1]
        for after, before in ((exposed.smoothed.picture, seen), (exposed.smoothed.truth, true))
    ]
    brighter = changes[1] > LEVEL
    assert brighter.sum() == 8 and brighter[100, 101]
    np.testing.assert_allclose(changes[0][brighter], changes[1][brighter], rtol=1e-5)  # float32
    # the tile itself loses 8 / 9 of its light and of its noise. Without a limit, the light that was
    # spread to its neighbour would make the change 1e5 times as large
    assert changes[0].mean() == pytest.approx(changes[1].mean(), abs=0.01 * LEVEL)


def test_pixels_changed_beyond_the_top_of_the_sensor_are_saturated():
    truth = uniform_shot(0.1).truth
    level = np.linspace(1.0, 90.0, truth.xyz.size).reshape(truth.xyz.shape)
    valid = np.ones(SMALL, bool)
    valid[-1, -1] = False
    before = truth.assign(xyz=truth.xyz.copy(data=level), valid=(("y", "x"), valid))
    less = before.assign(xyz=before.xyz * 0.5)
    opposite = changed_scenes.mirrored(Pair(before, truth), Pair(less, truth)).picture
    # the opposite of half the light is 1.5 times the light. Pixels above the top are saturated; the
    # top is a tenth above the brightest valid pixel
    top = level[valid, 1].max() * (1 + changed_scenes.TOP_SLACK)
    np.testing.assert_array_equal(opposite.valid, valid & (1.5 * level[..., 1] <= top))
    whole = before.assign(valid=truth.valid)
    opposite = changed_scenes.mirrored(Pair(whole, truth), Pair(less, truth)).picture
    assert opposite.valid.all()  # without saturated pixels, the top is unknown


def test_a_part_is_what_its_indices_choose():
    picture = uniform_shot(0.1, LARGE).truth
    picture = picture.assign(
        xyz=picture.xyz * np.random.default_rng(1).random(LARGE)[..., None],
        valid=(("y", "x"), np.random.default_rng(2).random(LARGE) > 0.5),
        of_all=((), 3.0),
    )
    for part in changed_scenes.parts_of(picture)[:2]:
        assert changed_scenes.part_of(picture, part).identical(picture.isel(part))


def test_each_block_is_the_first_in_half_of_the_joined_pictures():
    first = Pair(*[uniform_shot(0.1, LARGE).truth] * 2)
    second = Pair(*[first.truth.assign(xyz=first.truth.xyz * 2)] * 2)
    pairs = list(changed_scenes.joined_in_blocks(first, second, 6))
    shares = [pair.picture.xyz.values / first.truth.xyz.values for pair in pairs]
    assert all(set(np.unique(share)) == {1.0, 2.0} for share in shares)
    np.testing.assert_array_equal(sum(shares), 9.0)  # three times 1 and three times 2
    for pair in pairs:
        np.testing.assert_array_equal(pair.picture.xyz.values, pair.truth.xyz.values)


def test_the_mirrored_pair_changes_by_the_opposite():
    """This is exact where values are linear in the change, up to rounding to float32, 6e-8."""
    truth = uniform_shot(0.1, LARGE).truth
    before = Pair(truth.assign(variance=truth.xyz * 0 + 3.0, count=((), 2)), truth)
    more = truth.assign(xyz=truth.xyz * 1.25)
    after = Pair(more.assign(variance=truth.xyz * 0 + 6.0, count=((), 2)), more)
    found = changed_scenes.mirrored(before, after)
    np.testing.assert_allclose(found.picture.xyz, truth.xyz * 0.75, rtol=4e-7)
    np.testing.assert_allclose(found.truth.xyz, truth.xyz * 0.75, rtol=4e-7)
    np.testing.assert_array_equal(found.picture.variance, 1.5)  # inverse factor: stays above 0
    assert found.picture["count"] == 2 and found.picture.valid.identical(truth.valid)


def test_pictures_joined_of_blocks_tell_scatter_and_shift():
    """The mean of a large picture scatters as its tiles do; its mean square also shifts."""
    mean, said = stated([Mean()], uniform_shot(0.1, LARGE))["mean"]
    # five degrees of freedom: known to a third; two of these
    assert mean == pytest.approx(0.1 / np.sqrt(np.prod(LARGE)), rel=0.67)
    assert "6 pictures" in said
    square, said = stated([Mean(2)], uniform_shot(0.4, LARGE))["mean"]
    # opposite changes cancel: the shift is exact up to float32, and the scatter is 2 % of it
    assert float(said.split("of it ")[1].split(" to")[0]) == pytest.approx(0.16, rel=1e-3)
    assert square == pytest.approx(0.16, rel=0.001)


def test_how_well_the_rms_of_few_changes_is_known():
    rng = np.random.default_rng(1)
    for count, factor in ((2, 3.08), (score_errors.CHANGES, 1.69), (8, 1.55)):
        assert score_movements.known_within(count) == pytest.approx(factor, abs=0.01)
        rms = np.sqrt(np.mean(rng.standard_normal((count, 40000)) ** 2, axis=0))
        # the share of 40000 that are below is known to 0.15 %: four of these
        assert np.mean((rms < factor) & (rms > 1 / factor)) == pytest.approx(
            score_movements.SURE, abs=0.006
        )


def test_objects_are_left_out_of_changes_where_they_do_not_matter():
    asked = []
    shot = uniform_shot(0.1, LARGE)
    # a pixel shows one of two objects, or none
    labels = xr.Dataset(
        {"instance": (("y", "x"), np.arange(np.prod(LARGE), dtype=np.uint32).reshape(LARGE) % 3)}
    )

    def of_objects(picture, truth, labels):
        asked.append("objects")
        return [Score("contrast", 1.0, "", "car")]

    def whole(picture, truth, labels):
        asked.append(f"whole, objects: {len(np.unique(labels.instance)) - 1}")
        return [Score("mean", float(picture.xyz.mean()), "cd m-2")]

    def with_objects(picture, truth, labels):
        asked.append(f"needs objects: {len(np.unique(labels.instance)) - 1}")
        return [
            Score(
                "of objects",
                float(labels.instance.max()) + float(picture.xyz.where(labels.instance > 0).mean()),
                "cd m-2",
            )
        ]

    found = stated([of_objects, whole, with_objects], replace(shot, labels=labels))
    once = score_errors.CHANGES + 1  # the changes and the smoothed scene
    assert {name: asked.count(name) for name in asked} == {
        "objects": 2,
        "whole, objects: 2": 1,
        "whole, objects: 1": 1 + once,
        "needs objects: 2": 1 + once,
        "needs objects: 1": 1,
    }
    assert list(found) == ["mean", "of objects"]
    how = f"from {score_errors.CHANGES} pictures of two opposite changes of the scene"
    assert f"{how}, known within a factor of 1.8" in found["mean"][1]


def test_every_score_of_a_small_picture_has_an_error_those_of_objects_too():
    labels = xr.Dataset({"instance": (("y", "x"), np.ones(SMALL, np.uint32))})
    shot = replace(uniform_shot(0.1), labels=labels)
    unchanged = float(shot.picture.xyz.mean())

    def both(picture, truth, labels):
        mean = float(picture.xyz.mean())
        rare = [Score("rare", 1.0, "dB")] if mean == unchanged else []
        return [Score("mean", mean, "cd m-2"), Score("mean", 2 * mean, "cd m-2", "car"), *rare]

    scores = both(shot.picture, shot.truth, labels)
    found = score_errors.of_scores(replace(shot, scores=scores), [both])
    errors = found.errors
    frame, car = (errors["mean", "cd m-2", name] for name in ("", "car"))
    assert frame.standard_error > 0
    few = 1 / (score_errors.CHANGES - 1) + 1 / score_movements.FEW_TILES
    assert frame.degrees_of_freedom == pytest.approx(1 / few)
    assert car.standard_error == pytest.approx(2 * frame.standard_error)
    # a score that no changed scene has: its error is not known
    assert np.isnan(errors["rare", "dB", ""].standard_error)
    assert [term.part for term in found.terms] == ["mean"]  # of the frame only


def test_objects_of_a_large_picture_are_said_to_lack_renderer_noise():
    labels = xr.Dataset({"instance": (("y", "x"), np.ones(LARGE, np.uint32))})
    scores = [Score("mean", 1.0, "", "car")]
    metric = lambda picture, truth, labels: scores
    shot = replace(uniform_shot(0.1, LARGE), labels=labels, scores=scores)
    found = score_errors.of_scores(shot, [metric])
    assert found.errors == {} and [left.what for left in found.left_out] == [
        "renderer noise in scores of objects"
    ]


@pytest.mark.parametrize("tiles", [SMALL, LARGE])
@pytest.mark.slow
def test_a_metric_has_the_same_errors_alone_as_beside_others(tiles):
    """A later run with one more metric can therefore measure that metric only."""
    labels = xr.Dataset({"instance": (("y", "x"), np.ones(tiles, np.uint32))})
    shot = replace(uniform_shot(0.2, tiles), labels=labels)

    def square(picture, truth, labels):
        value = float((picture["xyz"].values[..., 1] ** 2).mean())
        return [Score("square", value, ""), Score("square", value, "", "car")]

    metrics = [PartMean(2), square]
    scores = [metric(*shot.pair, labels) for metric in metrics]
    shot = replace(shot, scores=[score for own in scores for score in own])
    both = score_errors.of_each(shot, metrics, scores)
    alone = [score_errors.of_each(shot, [metric], [own])[0] for metric, own in zip(metrics, scores)]
    assert both == alone and both[0].errors and both[1].errors
    whole = score_errors.of_scores(shot, metrics)
    joined = score_errors.joined([*both, both[1]])
    assert joined.errors == whole.errors and joined.left_out == whole.left_out
    assert len(whole.left_out) == (tiles is LARGE)


def test_smoothing_takes_away_noise_and_keeps_the_scene():
    """The relative noise is 0.1; edges with factors of 10 and 1e8 are larger than noise."""
    rng = np.random.default_rng(4)
    noise = 0.1
    light = np.where(np.arange(60) < 30, 1.0, 10.0) * np.ones((40, 1))
    light[20, 10] = 1e8
    light[20, 40] = 0.0
    noisy = light * (1 + noise * rng.standard_normal(light.shape))
    halves = noise * rng.standard_normal(light.shape)
    halves[20, 10] = 0.0
    smooth = noisy * (1 + smoothing_change(halves, noisy))
    assert (smooth >= 0).all()
    assert smooth[20, 10] == noisy[20, 10] and smooth[20, 40] == 0.0  # no noise, and no light
    flat = np.zeros(light.shape, bool)
    flat[:18, 2:28] = flat[:18, 32:58] = True
    left = np.std(smooth[flat] / light[flat]) / np.std(noisy[flat] / light[flat])
    # a plain mean of 9 tiles would leave 1 / 3; smoothing leaves more, because the variance within
    # a window of 9 tiles is known only to a half
    assert 1 / 3 < left < 0.75
    # tiles beside the edge and the lamp keep their light within three standard errors
    beside = [(5, 29), (5, 30), (20, 9), (19, 11)]
    assert all(abs(smooth[at] / noisy[at] - 1) < 3 * noise for at in beside)


def test_smoothing_tells_how_far_noise_has_shifted_a_score():
    """The mean square of light with relative noise of variance v is 1 + v; without noise it is
    1.
    """
    rng = np.random.default_rng(9)
    noise = 0.3
    quiet = uniform_shot(noise * rng.standard_normal(SMALL))
    noisy = 1 + noise * rng.standard_normal(SMALL)
    mixed = quiet.mixed.copy(data=quiet.mixed.values * noisy)
    light = quiet.light.copy(data=quiet.light.values * noisy)
    picture = quiet.picture.assign(xyz=quiet.picture.xyz * noisy[..., None])

    def expose(changed):
        share = changed.values[3] / light.values[3]
        return picture.assign(xyz=picture.xyz.copy(data=picture.xyz.values * share[..., None]))

    scores = Mean(2)(picture, picture)
    shot = ScoredShot(picture, picture, None, scores, light, mixed, quiet.scene, expose)
    errors = score_errors.of_scores(shot, [Mean(2)]).errors
    error = errors["mean", "", ""]
    # the window's mean keeps a ninth of the variance, tiles that differ by chance keep more
    assert -1.1 * noise**2 < error.less_noise < -0.4 * noise**2


@dataclass(frozen=True)
class TwiceWhite:
    """A score that depends on the white only."""

    MEAN_OF_PARTS: ClassVar[bool] = True
    WHITE_SCORE: ClassVar[str] = "white"
    white_cd_m2: float = 0.0

    def __call__(self, picture, truth, labels=None):
        white = self.white_cd_m2 or white_cd_m2(truth)
        return [Score("twice", 2 * white, ""), Score("white", white, "cd m-2")]


@pytest.mark.parametrize("tiles", [SMALL, LARGE])
def test_the_white_is_that_of_the_whole_picture_and_its_error_moves_what_follows_it(tiles):
    noise = 0.1
    quiet = uniform_shot(noise, tiles)
    rng = np.random.default_rng(8)
    noisy = 1 + noise * rng.standard_normal(tiles)
    picture = quiet.picture.assign(xyz=quiet.picture.xyz * noisy[..., None])
    mixed, light = (v.copy(data=v.values * noisy) for v in (quiet.mixed, quiet.light))
    scores = TwiceWhite()(picture, picture)
    shot = ScoredShot(picture, picture, None, scores, light, mixed, quiet.scene, lambda _: picture)
    errors = score_errors.of_scores(shot, [TwiceWhite()]).errors
    white = errors["white", "cd m-2", ""]
    twice = errors["twice", "", ""]
    assert white.standard_error > 0
    if tiles is LARGE:
        # parts would have whites of their own
        assert twice.standard_error == pytest.approx(2 * white.standard_error, rel=1e-9)
        # Of a normal distribution, 0.092 lie within one sigma of the percentile, on either side.
        # A change or its opposite moves them across it: a variance of 1 / 4 each. The density is
        # 0.0267 / sigma.
        share = np.sqrt(0.092 / 4 / np.prod(tiles))
        # four changes and the curvature of the distribution: 5 % each; three of these
        assert white.standard_error == pytest.approx(share / (0.0267 / noise) * LEVEL, rel=0.2)
    chosen = replace(shot, scores=TwiceWhite(90.0)(picture, picture))
    fixed = score_errors.of_scores(chosen, [TwiceWhite(90.0)]).errors
    assert all(error.standard_error == 0 == error.less_noise for error in fixed.values())


def test_a_score_that_rests_on_few_tiles_is_known_with_fewer_degrees_of_freedom():
    """The score is a sum of eight tiles. Each tile has one sample of its noise; six changes take
    this sample with random signs.
    """
    rng = np.random.default_rng(2)
    trials = 20000
    tiles = score_movements.FEW_TILES
    changes = score_errors.CHANGES
    halves = rng.standard_normal((trials, 1, tiles))
    signs = np.where(rng.random((trials, changes, tiles)) < 0.5, 1.0, -1.0)
    changes_of_score = (signs * halves).sum(-1)
    scatter = changes_of_score.std(axis=1, ddof=1)
    off = np.abs(rng.standard_normal((trials, tiles)).sum(-1))
    movement = score_movements.movement_of_lots(changes_of_score[0])
    assert movement.scatter == pytest.approx(scatter[0])
    freedom = score_errors._error(movement, 0.0).degrees_of_freedom
    inside = {f: np.mean(off < student_factor(f) * scatter) for f in (freedom, changes - 1)}
    # chance: 0.0015; the two estimates make the tails a little heavier than Student's
    assert 0.94 < inside[freedom] < 0.965
    assert inside[changes - 1] < 0.94


def test_an_unknown_variance_stays_one_number_in_memory():
    shot = uniform_shot(0.1)
    unknown = np.broadcast_to(np.nan, shot.picture["variance"].shape)
    picture = shot.picture.assign(variance=shot.picture["variance"].copy(data=unknown))
    factor = np.linspace(0.5, 4.0, unknown[..., 0].size).reshape(unknown.shape[:2])
    scaled = changed_scenes._scaled(Pair(picture, shot.truth), factor)
    assert not any(scaled["variance"].values.strides)
    assert np.isnan(scaled["variance"].values).all()
    # the other values are those of a picture with a known variance
    known = changed_scenes._scaled(Pair(shot.picture, shot.truth), factor)
    xr.testing.assert_identical(scaled.drop_vars("variance"), known.drop_vars("variance"))
    other = np.broadcast_to(np.nan, unknown.shape)
    assert changed_scenes._same(unknown, other)
    assert not changed_scenes._same(unknown, np.broadcast_to(1.0, unknown.shape))


def test_a_single_change_of_a_score_has_no_known_scatter_beside_the_white():
    moved = score_movements.movement_of_parts(np.array([0.1]))
    white = score_movements.Movement(1.0, 5.0, 0.1, 1.0, 5, "")
    assert score_movements.beside_white(moved, 0.5, white) == moved
