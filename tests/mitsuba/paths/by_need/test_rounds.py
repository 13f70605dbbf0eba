"""More paths where cameras need them: the mean light does not change, and tiles that no camera uses
get no further paths.
"""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.paths.by_need import rounds as by_need_rounds
from isethdr_mitsuba.paths.by_need.plan import affordable, more_paths
from isethdr_mitsuba.paths.by_need.rounds import Rounds, render_by_need
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.demand import Demand, NoiseLimit
from isethdr_core.uncertainty import ledger

from ..test_integrator import follower

SIZE = {"width": 24, "height": 16, "margin": 0.0, "step_nm": 100.0, "max_depth": 3}
WEIGHTS = {"sky": 1.0, "headlights": 1.0, "other": 1.0, "streetlights": 1.0}
SHARE = 0.5


@pytest.fixture(autouse=True)
def llvm():
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def like_a_camera(luminance):
    """Return noise limits: shot noise and a floor; no camera sees the first column."""
    scale = 30.0 / luminance.mean()  # electrons per cd/m2
    limit = np.sqrt(luminance * scale + 1) / scale
    limit[:, 0] = np.inf
    return NoiseLimit(WEIGHTS, np.stack([limit] * 3))


def rounds(paths, seed):
    return Rounds(paths, np.ones((16, 24), int), seed)


def rendered(paths, seed, luminance):
    """Return the rounds of a rendering with noise limits that are known beforehand."""
    found = rounds(paths, seed)
    render_by_need(found, lambda _: like_a_camera(luminance), SHARE)
    return found


def judged(paths, samples, passes=1, seed=900):
    """Return luminance (group, row, column) of even passes."""
    from isethdr_core.physics.photometry import xyz_weights

    weights = np.zeros(paths.even_pass(1, 2).shape[1])
    weights[: len(paths.wavelength_nm)] = xyz_weights(paths.wavelength_nm)[1]
    whole = sum(paths.even_pass(seed + k, samples).astype(float) for k in range(passes))
    return np.einsum("b,gbt->gt", weights, whole).reshape(-1, 16, 24) / samples / passes


def test_noise_is_brought_to_the_limit_without_a_change_of_light(make):
    scene = make.street(6)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    judge = judged(paths, 1024, 2)
    found = rendered(paths, 3, judge.sum(0))
    taken = sum(t.paths for t in found.buffers).max(0).reshape(16, 24)
    assert (taken[:, 0] == 16).all(), "nobody looks: no more than the first paths"
    assert taken[:, 1:].max() > 64
    assert found.moved is not None, "rare light is looked for in every rendering"
    light = sum(t.mean()[:, 1] for t in found.buffers) / 2
    error = (light.sum(0).reshape(16, 24) - judge.sum(0)) / like_a_camera(judge.sum(0)).xyz[1]
    # a share of 0.5 is required; one tile in a hundred may exceed it, and some light is rarer than
    # estimated
    assert np.quantile(np.abs(error[:, 1:]), 0.9) < 2 * SHARE
    stated = np.sqrt((found.xyz_noise()[:, 1] ** 2).sum(0)).reshape(16, 24)
    stated = (stated / like_a_camera(judge.sum(0)).xyz[1])[:, 1:]
    assert np.quantile(stated, 0.95) < 1.3 * SHARE
    for g in range(len(judge)):
        noise = np.sqrt((found.xyz_noise()[g, 1] ** 2).sum())
        # in the group with the rarest light, 24 renderings spread twice as widely as stated
        assert light[g].sum() == pytest.approx(
            judge[g].sum(), abs=10 * noise + 1e-4 * judge[g].sum()
        )


def test_affordable_paths_have_the_mean_that_is_allowed():
    """The factor on needed paths is the ratio of the allowed and the needed mean.

    The tiles need 0 to 999 paths of each group and have none. Numbers of paths are multiples of 8,
    which adds 3.5 per group in the mean.
    """
    needed = np.stack([np.arange(1000.0), np.arange(1000.0)[::-1]])
    have = np.zeros((2, 1000))
    factor = affordable(needed, have, 350.0)
    assert factor == pytest.approx((350.0 - 7.0) / needed.sum(0).mean(), rel=0.01)
    assert (more_paths(factor * needed, have)).sum(0).mean() <= 350.0
    assert affordable(needed, have, 1e4) == 1.0


def test_the_affordable_factor_is_above_zero_if_the_first_paths_exceed_the_mean():
    """No path can be added. The factor then states the noise of the paths that there are."""
    needed = np.stack([np.arange(1000.0), np.arange(1000.0)[::-1]])
    have = np.full((2, 1000), 400.0)
    factor = affordable(needed, have, 350.0)
    assert factor == pytest.approx(400 / 999)
    assert not more_paths(factor * needed, have).any()
    assert affordable(np.minimum(needed, 300.0), have, 350.0) == 1.0, "none is needed"


def test_tiles_beyond_the_field_of_the_camera_get_fewer_first_paths(make):
    scene = make.street(6)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    field = slice(2, 14), slice(4, 20)
    found = Rounds(paths, np.ones((16, 24), int), 3, in_field=field)
    found.pilot()
    taken = sum(t.paths for t in found.buffers).reshape(-1, 16, 24)
    expected = np.full((16, 24), 4)
    expected[field] = 16
    assert (taken == expected).all()
    # at least two batches, because a single one has no spread
    assert min(t.batches.min() for t in found.buffers) >= 2


@pytest.mark.slow
def test_a_mean_number_of_paths_is_kept_and_the_noise_rises_alike_in_all_tiles(
    make, monkeypatch, capsys
):
    """The needed paths of all tiles are reduced by one factor, and noise rises by its root."""
    monkeypatch.setattr(by_need_rounds, "MANY", 16)  # print the advice for this small picture, too
    scene = make.street(6)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    luminance = judged(paths, 256).sum(0)
    free = rendered(paths, 3, luminance)
    mean = float(sum(t.paths for t in free.buffers).sum(0).mean())
    most = 0.7 * mean
    assert "type renderer.most_mean_samples" in capsys.readouterr().err
    found = Rounds(paths, np.ones((16, 24), int), 3, most_mean=most)
    render_by_need(found, lambda _: like_a_camera(luminance), SHARE)
    taken = float(sum(t.paths for t in found.buffers).sum(0).mean())
    assert 0.8 * most < taken <= most
    assert free.affordable == 1.0 and found.affordable < 0.8
    stated = [np.sqrt((r.xyz_noise()[:, 1] ** 2).sum(0)) for r in (free, found)]
    lit = stated[0] > 0
    ratio = np.median(stated[1][lit] / stated[0][lit])
    assert 1.0 < ratio < 1.2 / np.sqrt(found.affordable)


@pytest.mark.slow
def test_bits_are_equal_on_any_number_of_threads(make):
    import drjit as dr

    scene = make.street(6)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    luminance = np.full((16, 24), 0.5)
    before = dr.thread_count()
    try:
        found = []
        for count in (1, 2):
            dr.set_thread_count(count)
            found.append(rounds(paths, 3))
            render_by_need(found[-1], lambda _: like_a_camera(luminance), 3 * SHARE)
    finally:
        dr.set_thread_count(before)
    taken = sum(t.paths for t in found[0].buffers).max(0)
    assert taken.max() > 64, "some tiles took further rounds"
    assert np.array_equal(*(r.radiance() for r in found))


def test_an_exposure_that_changes_has_the_need_worked_out_again(make):
    scene = make.street(3)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    calls = []

    def limit(_radiance):
        calls.append(len(calls))
        level = np.full((3, 16, 24), 1e9)  # nothing is needed
        return NoiseLimit(WEIGHTS, level, np.array([1.0 if len(calls) == 1 else 1.5]), False)

    rows = ledger.Ledger()
    with ledger.stage(rows, "renderer test"):
        ledger.error(0.0, "1", "bound", "none")
        render_by_need(rounds(paths, 1), limit, SHARE)
    assert len(calls) == 2
    assert [omission.bound for omission in rows[0].left_out] == [pytest.approx(0.5)]


def test_a_number_of_paths_or_an_error_that_is_asked_for_goes_before_the_cameras():
    assert MitsubaRenderer(noise_share_allowed=0.6).limit_share() == 0.6
    assert MitsubaRenderer(noise_share_allowed=0.6, samples=16).limit_share() is None
    assert MitsubaRenderer(noise_share_allowed=0.6, error_allowed=0.1).limit_share() is None


@pytest.mark.slow
def test_the_renderer_goes_by_the_cameras_where_it_is_asked_for_nothing_else(make):
    scene = make.street(3)
    settings = MitsubaRenderer(**SIZE, noise_share_allowed=0.6)
    demand = Demand(noise_limit=lambda ds: like_a_camera(np.ones((16, 24))))
    ds = settings(scene, demand)
    assert ds.attrs["limit_share"] == settings.noise_share_allowed
    assert ds.sizes["y"] == 16 and np.isfinite(ds.xyz_noise).all()
    # half the difference between the two buffers has the stated noise
    lit = ds.xyz_noise[1, 1].values > 0
    ratio = ds.half_difference[1].values[lit] / ds.xyz_noise[1, 1].values[lit]
    # batches of a low-discrepancy sequence overstate the noise by up to a factor of two
    assert 0.4 < np.sqrt(np.mean(ratio**2)) < 1.5


@pytest.mark.slow
def test_plans_do_not_bias_any_group(make):
    """Compare 50 renderings, each planned from its own first paths, with 50 times the paths."""
    scene = make.street(8)
    paths = follower(scene, MitsubaRenderer(**SIZE), scene.light_groups())
    luminance = judged(paths, 1024, 4).sum(0)
    light = []
    taken = []
    for seed in range(50):
        found = rounds(paths, seed)
        # the limit follows from the noisy picture, as in a run
        render_by_need(found, lambda _, f=found: like_a_camera(smoothed(f, luminance)), SHARE)
        light.append(sum(t.mean()[:, 1] for t in found.buffers).sum(1) / 2)
        taken.append(sum(t.paths for t in found.buffers).mean())
    light = np.array(light)
    passes = int(np.ceil(50 * np.mean(taken) / 1024))
    each = np.array([judged(paths, 1024, 1, 5000 + k).sum((1, 2)) for k in range(passes)])
    judge = each.mean(0)
    bias = light.mean(0) / judge - 1
    error = np.hypot(
        light.std(0, ddof=1) / judge / np.sqrt(len(light)),
        each.std(0, ddof=1) / judge / np.sqrt(passes),
    )
    print("bias", bias, "+-", error, "paths", np.mean(taken))
    assert (np.abs(bias) < 1e-3 + 3 * error).all()


def smoothed(found, luminance):
    """Return the luminance found by the rounds so far, at least a tenth of the true one."""
    light = sum(t.mean()[:, 1] for t in found.buffers).sum(0).reshape(16, 24) / 2
    return np.maximum(light, 0.1 * luminance)
