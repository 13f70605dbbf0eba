"""Mixing light groups: linear to the last bits, lazy, with an error for missing groups."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.lighting import IdealLighting, IsetLighting, WeightsLighting
from isethdr_core.physics.photometry import luminance
from isethdr_core.physics.radiometry import energy_from_photons
from isethdr_core.uncertainty import ledger

BANDS = np.arange(400.0, 701.0, 10.0)
FLOAT32 = 6e-8  # half a unit in the last place of float32: mixing rounds once


def scene(groups, seed=0, height=9, width=12, margin=0):
    """Return random scene radiance over many decades; `groups` maps names to scales."""
    rng = np.random.default_rng(seed)
    x = quantities.centres(width, 0.6)
    y = quantities.centres(height, 0.45)
    cube = np.stack(
        [scale * 10 ** rng.uniform(-4, 0, (len(BANDS), height, width)) for scale in groups.values()]
    )
    field = (0.6 * (width - 2 * margin) / width, 0.45 * (height - 2 * margin) / height)
    return quantities.scene_radiance(cube, groups, BANDS, x, y, field)


FOUR = {"sky": 1.0, "headlights": 1e6, "streetlights": 1e3, "other": 1.0}


def test_mixing_is_the_weighted_sum_over_fifteen_decades_of_weight():
    ds = scene(FOUR)
    weights = {"sky": 1e-9, "headlights": 1e-3, "streetlights": 1e6, "other": 1.0}
    mixed = WeightsLighting(weights)(ds)
    exact = sum(
        w * ds.radiance.sel(light_group=g).values.astype(np.longdouble) for g, w in weights.items()
    )
    assert np.abs(mixed.values / exact - 1).max() < FLOAT32
    assert mixed.dtype == np.float32 and mixed.attrs["weights"] == weights
    assert (
        mixed.attrs["field_width"] == pytest.approx(0.6)
        and mixed.attrs["units"] == quantities.RADIANCE
    )
    quantities.check_mixed(mixed)


def test_float32_sums_would_lose_what_float64_keeps():
    """The scene has one bright group and 40 faint ones. In sums of float32, the light of the faint
    groups is lost.
    """
    ds = scene({"sky": 1.0} | {f"g{i}": 1e-8 for i in range(40)})
    exact = ds.radiance.values.astype(np.longdouble).sum(0)
    naive = np.zeros(exact.shape, np.float32)
    for group in ds.radiance.values:
        naive += group
    assert np.abs(naive / exact - 1).max() > 3 * FLOAT32
    assert np.abs(IdealLighting()(ds).values / exact - 1).max() < FLOAT32


def test_ideal_is_weights_of_one_and_mixing_is_additive():
    ds = scene(FOUR)
    ideal = IdealLighting()(ds)
    np.testing.assert_array_equal(ideal, WeightsLighting({}, others=1.0)(ds))
    parts = sum(WeightsLighting({g: 1.0})(ds).values.astype(float) for g in FOUR)
    assert np.abs(ideal.values / parts - 1).max() < FLOAT32
    doubled = WeightsLighting({}, others=2.0)(ds)
    np.testing.assert_array_equal(doubled, 2 * ideal)  # a power of two is exact


class FailingArray(xr.backends.BackendArray):
    """A lazy cube that fails when light of `forbidden` groups, or of several groups at once, is
    read.
    """

    def __init__(self, values, forbidden):
        self.values = values
        self.forbidden = forbidden
        self.shape = values.shape
        self.dtype = values.dtype

    def __getitem__(self, key):
        def read(key):
            assert isinstance(key[0], (int, np.integer)), (
                f"several groups were read at once: {key[0]}"
            )
            assert key[0] not in self.forbidden, f"group {key[0]} was read"
            return self.values[key]

        return xr.core.indexing.explicit_indexing_adapter(
            key, self.shape, xr.core.indexing.IndexingSupport.BASIC, read
        )


def lazy(ds, forbidden=()):
    data = xr.core.indexing.LazilyIndexedArray(FailingArray(ds.radiance.values, forbidden))
    out = ds.drop_vars("radiance")
    out["radiance"] = xr.Variable(quantities.SCENE_DIMS, data, ds.radiance.attrs)
    return out


def test_groups_of_weight_zero_are_never_read_and_say_so():
    ds = scene(FOUR)
    weights = {"headlights": 2.0, "other": 0.5}
    book = ledger.Ledger()
    with ledger.stage(book, "lighting"):
        mixed = WeightsLighting(weights)(lazy(ds, forbidden=(0, 2)))
    np.testing.assert_array_equal(mixed, WeightsLighting(weights)(ds))
    assert {row.what for row in book[0].left_out} == {"group sky", "group streetlights"}
    assert all(row.bound == 0 for row in book[0].left_out)
    with pytest.raises(AssertionError, match="group 0 was read"):  # the cube does fail
        WeightsLighting({"sky": 1.0})(lazy(ds, forbidden=(0,)))


def test_narrow_asks_for_no_dark_group():
    light = WeightsLighting({"sky": 0.0, "headlights": 1.0})
    assert light.narrow(Demand()).groups == ("headlights",)
    assert light.narrow(Demand(groups=("headlights", "sky", "other"))).groups == ("headlights",)
    # without a list of groups, `others` may stand for any group: no group may be dropped
    assert WeightsLighting({"sky": 0.0}, others=1.0).narrow(Demand()).groups is None
    # and the narrowed scene, which lacks the dark group, can be lit
    ds = scene({"headlights": 1.0})
    np.testing.assert_array_equal(light(ds), ds.radiance[0])


def test_missing_group_negative_weight_and_bad_light_are_errors():
    ds = scene(FOUR)
    with pytest.raises(
        ConfigError, match="no light group 'headlight'; did you mean 'headlights'.*sky"
    ):
        WeightsLighting({"headlight": 1.0})(ds)
    for bad in (-1.0, float("nan"), float("inf")):
        with pytest.raises(ConfigError, match="'sky'.* in it; expected 0 to"):
            WeightsLighting({"sky": bad})
    for bad in (-1e-9, np.nan, np.inf):
        broken = ds.copy(deep=True)
        broken.radiance.values[1, 20, 3, 3] = bad
        with pytest.raises(UnitError, match="'headlights'.*560-630 nm"):
            IdealLighting()(broken)
        WeightsLighting({"sky": 1.0})(broken)  # light that is not used is not checked
    with pytest.raises(UnitError, match="empty"):
        IdealLighting()(ds.isel(x=slice(0, 0)))
    with pytest.raises(UnitError, match="beyond float32"):
        WeightsLighting({"headlights": 1e12})(ds.assign(radiance=ds.radiance * np.float32(1e30)))


def test_black_scene_stays_black():
    ds = scene(dict.fromkeys(FOUR, 0.0))
    assert not IdealLighting()(ds).values.any()
    assert not WeightsLighting(dict.fromkeys(FOUR, 1.0), relative_to_mean_cd_m2=100.0)(
        ds
    ).values.any()


def test_relative_weights_bring_each_group_to_the_mean_within_the_field():
    ds = scene(FOUR, margin=2)
    mixed = WeightsLighting({"headlights": 0.5}, relative_to_mean_cd_m2=100.0)(ds)
    inside = luminance(mixed.values, BANDS)[2:-2, 2:-2]
    assert inside.mean() == pytest.approx(50.0, rel=2e-7)  # float32 light, mean of 40 tiles


@pytest.fixture(scope="module")
def reference():
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set: reference numbers are not part of the project")
    data = np.load(Path(folder) / "isetcam" / "g_lightgroups.npz")
    # the reference was made with h = 6.626176e-34 (ISETCam); ours is CODATA's
    cube = np.moveaxis(data["groups"].astype(float), (3, 2), (0, 1))
    energy = energy_from_photons(cube, data["wave"], axis=1) * (6.626176e-34 / 6.62607015e-34)
    names = ("headlights", "streetlights", "other", "sky")
    ds = quantities.scene_radiance(
        energy, names, data["wave"], quantities.centres(48, 0.6), quantities.centres(32, 0.4)
    )
    return data, ds


def test_iset_weights_agree_with_the_papers_script(reference, largest_difference):
    data, ds = reference
    for k in range(len(data["case_DR"])):
        low = None if np.isnan(data["case_low"][k]) else float(data["case_low"][k])
        light = IsetLighting(float(data["case_DR"][k]), low, tuple(data["case_draws"][k]))
        mixed = light(ds)
        found = [
            mixed.attrs["iset_weights"][g] for g in ("headlights", "streetlights", "other", "sky")
        ]
        # both programs hold light in float32; the measured difference is 2e-7
        np.testing.assert_allclose(found, data["weights"][k], rtol=1e-6)
        largest_difference("light-group weights", np.array(found), data["weights"][k])
        own = luminance(mixed.values, data["wave"])
        for name, function in (
            ("min", np.min),
            ("median", np.median),
            ("mean", np.mean),
            ("max", np.max),
        ):
            np.testing.assert_allclose(function(own), data[f"lum_{name}"][k], rtol=1e-6)


def test_iset_is_seeded_and_refuses_a_dark_group(reference):
    _, ds = reference
    one = IsetLighting(seed=3)(ds)
    two = IsetLighting(seed=3)(ds)
    np.testing.assert_array_equal(one, two)
    assert IsetLighting(seed=4)(ds).attrs["weights"] != one.attrs["weights"]
    with pytest.raises(ConfigError, match="'streetlights' is dark"):
        IsetLighting()(
            ds.assign(
                radiance=ds.radiance.where(
                    ds.light_group != "streetlights",
                    0,
                ).assign_attrs(ds.radiance.attrs)
            )
        )
