"""Sample accumulation: which renderings are averaged, how noisy their mean is, and the mean."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from isethdr_core.demand import Demand
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.runs.sample_accumulation import (
    ALL_BANDS,
    Known,
    known,
    pooled,
    pooled_noise,
    rendered_anew,
)
from isethdr_core.storage import store
from isethdr_core.storage.join import join_scenes


def apart(spans):
    return all(p[1] <= q[0] or q[1] <= p[0] for p, q in itertools.combinations(spans, 2))


def length(spans):
    return sum(end - first for first, end in spans)


def test_spans_without_overlap_that_hold_most_paths_are_pooled():
    """The choice has as many paths as the best of all subsets without overlap."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        spans = [
            (int(a), int(a + n)) for a, n in zip(rng.integers(0, 12, 6), rng.integers(2, 9, 6))
        ]
        kept = pooled(spans)
        chosen = [
            some for n in range(1, 7) for some in itertools.combinations(spans, n) if apart(some)
        ]
        assert apart([spans[k] for k in kept]) and length(spans[k] for k in kept) == max(
            map(length, chosen)
        )


def test_what_states_no_paths_is_not_pooled_and_one_path_stands_alone():
    assert pooled([None, None]) == [0]
    assert pooled([None, (0, 8)]) == [1]
    assert pooled([(0, 1), (1, 2)]) == [0]
    assert pooled([(0, 1), (1, 9)]) == [1]


def test_the_noise_of_a_mean_of_independent_renderings():
    assert pooled_noise([8, 8], [0.2, 0.2]) == pytest.approx(0.2 / np.sqrt(2))
    assert pooled_noise([96, 304], [0.1, 0.1 * np.sqrt(96 / 304)]) == pytest.approx(
        0.1 * np.sqrt(96 / 400)
    )
    assert pooled_noise([8, 8], [None, None]) is None
    assert pooled_noise([8, 8], [0.2, None]) == pooled_noise([8, 8], [0.2, 0.2])


def attributes(span, noise, bands=(500.0,), whole=True):
    return {
        "groups": ["sky"],
        "absent_groups": [],
        "bands_asked": None if whole else bands,
        "wavelength_nm": list(bands),
        "path_span": {"sky": list(span)},
        "noise": {"sky": noise},
    }


def test_what_is_known_is_what_is_known_of_the_worst_band():
    first = attributes((0, 96), 0.3)
    more = attributes((96, 192), 0.3)
    assert known([], "sky", ALL_BANDS) == Known()
    both = known([first, more], "sky", ALL_BANDS)
    assert (both.paths, both.next) == (192, 192) and both.noise == pytest.approx(0.3 / np.sqrt(2))
    few = attributes((192, 200), 0.9, (500.0, 600.0), whole=False)
    assert known([few], "sky", ALL_BANDS) == Known()
    assert known([first, few], "sky", (500.0, 600.0)) == Known(8, 0.9, 200)
    assert known([first], "sky", (500.0, 600.0)) == Known(), (
        "a band that is not there begins with the first path"
    )


GRID = (np.array([500.0, 600.0]), centres(12, 0.6), centres(8, 0.4))


def rendering(folder, name, span, seed, groups=("sky",), bands=slice(None)):
    """Store a rendering of random light and noise, and open it."""
    rng = np.random.default_rng(seed)
    ds = scene_radiance(rng.gamma(2.0, 1e-3, (len(groups), 2, 8, 12)), groups, *GRID)
    ds["xyz_noise"] = (
        ("light_group", "xyz_channel", "y", "x"),
        rng.random((len(groups), 3, 8, 12)).astype(np.float32),
    )
    ds["half_difference"] = (
        ("light_group", "y", "x"),
        rng.standard_normal((len(groups), 8, 12)).astype(np.float32),
    )
    noise = {g: 0.1 * (k + 1) for k, g in enumerate(groups)}
    store.write_store(
        folder,
        name,
        {"": ds.isel(wavelength=bands)},
        {"recipe": "r", "path_span": dict.fromkeys(groups, span), "noise": noise},
    )
    return store.open_store(folder / f"{name}.zarr")


def test_the_mean_is_weighted_by_paths_and_its_noise_follows(tmp_path):
    a = rendering(tmp_path, "a", (0, 96), 1)
    b = rendering(tmp_path, "b", (96, 400), 2)
    joined = join_scenes([a, b])
    want = (96 * a.radiance.values.astype(float) + 304 * b.radiance.values) / 400
    # float32 values: half a unit in the last place
    np.testing.assert_allclose(joined.radiance.values, want, rtol=6.1e-8)
    np.testing.assert_array_equal(
        joined.radiance[:, 1, 2:5, [3, 1]].values, joined.radiance.values[:, 1, 2:5][..., [3, 1]]
    )
    squares = (96 * a.xyz_noise.values.astype(float)) ** 2 + (
        304 * b.xyz_noise.values.astype(float)
    ) ** 2
    np.testing.assert_allclose(joined.xyz_noise.values, np.sqrt(squares) / 400, rtol=1e-6)
    apart = (96 * a.half_difference.values.astype(float) + 304 * b.half_difference.values) / 400
    np.testing.assert_allclose(joined.half_difference.values, apart, rtol=1e-6, atol=1e-7)
    assert joined.attrs["paths"] == {"sky": 400} and joined.attrs["noise"]["sky"] == pytest.approx(
        0.1 * np.hypot(96, 304) / 400
    )
    # the order of the stores does not change the light
    np.testing.assert_allclose(join_scenes([b, a]).radiance.values, want, rtol=6.1e-8)


def test_a_rendering_of_the_same_paths_is_not_counted_twice(tmp_path):
    a = rendering(tmp_path, "a", (0, 96), 1)
    again = rendering(tmp_path, "again", (0, 64), 3)
    joined = join_scenes([a, again])
    np.testing.assert_array_equal(joined.radiance.values, a.radiance.values)
    assert joined.attrs["paths"] == {"sky": 96}


def test_groups_and_bands_are_pooled_one_by_one(tmp_path):
    both = rendering(tmp_path, "both", (0, 8), 1, ("sky", "lamps"))
    more = rendering(tmp_path, "more", (8, 32), 2, ("lamps",), slice(0, 1))
    joined = join_scenes([both, more], ("sky", "lamps"))
    np.testing.assert_array_equal(joined.radiance[0].values, both.radiance[0].values)
    np.testing.assert_array_equal(joined.radiance[1, 1].values, both.radiance[1, 1].values)
    np.testing.assert_allclose(
        joined.radiance[1, 0].values,
        (8 * both.radiance[1, 0].values.astype(float) + 24 * more.radiance[0, 0].values) / 32,
        rtol=6.1e-8,
    )
    assert joined.attrs["paths"] == {"sky": 8, "lamps": 8}, "of the band that is known worst"
    assert joined.attrs["noise"]["lamps"] == 0.2
    # bands that are means of different renderings may share paths: their standard deviations are
    # added without squares, which never gives too little
    one = both.xyz_noise.values[1].astype(float)
    two = more.xyz_noise.values[0].astype(float)
    np.testing.assert_allclose(
        joined.xyz_noise.values[1], np.hypot(8 * one, 24 * two) / 32 + one, rtol=1e-6
    )


class Continues:
    """A renderer that must be told what is stored, as its Protocol states it."""

    def enough(self, paths, noise):
        """Return whether no more samples are needed."""
        return True

    def __call__(self, description, demand, known):
        """Return what it is told."""
        return known


def test_a_renderer_that_accumulates_samples_is_told_that_there_are_none():
    description = SimpleNamespace(light_groups=lambda: ("sky", "lamps"))
    assert rendered_anew(Continues(), description, Demand()) == {"sky": Known(), "lamps": Known()}
    assert rendered_anew(Continues(), description, Demand(groups=("sky",))) == {"sky": Known()}
    plain = lambda description, demand: demand
    assert rendered_anew(plain, description, Demand()) == Demand()
