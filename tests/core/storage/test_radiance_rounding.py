"""Radiance is rounded within a twentieth of its noise, without bias, and the store states it."""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.photometry import luminance
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.storage import store
from isethdr_core.storage.encoding import KEEPBITS, keep_mantissa_bits
from isethdr_core.storage.radiance_rounding import bits_of_tiles, rounded_by_noise
from isethdr_core.uncertainty import ledger

BANDS = np.linspace(400.0, 700.0, 31)


def scene(relative_noise):
    """Return radiance of 40 x 60 tiles over ten decades, with a relative noise of each tile."""
    random = np.random.default_rng(1)
    level = 10.0 ** random.uniform(-8, 2, (1, 1, 40, 60))
    values = (level * random.uniform(0.2, 1.0, (1, 31, 40, 60))).astype(np.float32)
    ds = scene_radiance(values, ("sky",), BANDS, centres(60, 0.6), centres(40, 0.4))
    noise = np.zeros((1, 3, 40, 60), np.float32)
    noise[0, 1] = luminance(values[0], BANDS) * relative_noise
    ds["xyz_noise"] = (("light_group", "xyz_channel", "y", "x"), noise, {"units": "cd m-2"})
    return ds


def test_rounding_is_within_a_twentieth_of_the_noise():
    noise = 10.0 ** np.random.default_rng(2).uniform(-2.5, 1.0, (40, 60))
    ds = scene(noise)
    found = rounded_by_noise(ds).radiance
    error = np.abs(luminance(found.values[0] - ds.radiance.values[0].astype(float), BANDS))
    allowed = luminance(ds.radiance.values[0], BANDS) * noise / 20
    assert (error <= allowed * (1 + 1e-6)).all()  # float32 sums
    each = np.abs(found.values / ds.radiance.values - 1).max(axis=1)[0]
    assert (each <= np.clip(noise / 20, 0, 2**-7) * (1 + 1e-6)).all()
    # rounding to nearest: the mean over 74,400 errors of at most 0.8 % is below 0.01 %
    assert abs((found.values / ds.radiance.values - 1).mean()) < 1e-4


def test_tiles_without_noise_keep_the_bits_of_a_run():
    noise = np.where(np.arange(60) < 30, 0.0, 0.5) * np.ones((40, 1))
    ds = scene(noise)
    found = rounded_by_noise(ds).radiance.values
    exact = keep_mantissa_bits(ds.radiance.values, KEEPBITS)
    assert np.array_equal(found[..., :30], exact[..., :30])
    assert not np.array_equal(found[..., 30:], exact[..., 30:])
    whole = rounded_by_noise(ds, None).radiance.values
    assert np.array_equal(whole[..., :30], ds.radiance.values[..., :30])


def test_bits_are_the_fewest_that_suffice():
    one = np.ones((1, 6))
    noise = np.array([[0.0, np.nan, 10.0, 20 * 2**-8.0, 20 * 2**-8.0 * 0.999, 20 * 2**-14.0]])
    # 2^-8 is the largest error of 7 bits
    assert bits_of_tiles(one, noise, 12).tolist() == [[12, 12, 6, 7, 8, 12]]
    assert bits_of_tiles(0 * one, noise, 12).tolist() == [[12] * 6]


def test_the_stored_standard_error_holds_the_rounding(tmp_path):
    """The error term of the store then covers only the bits of tiles without noise: 2^-13."""
    plain = scene(np.full((40, 60), 0.5))
    ds = rounded_by_noise(plain)
    with ledger.gathered("store") as row:
        back = store.open_store(store.write_store(tmp_path, "a", {"": ds}, {}))
    assert np.array_equal(back.radiance.values, ds.radiance.values)
    assert back.radiance.attrs["keepbits"] == 12 and "1/20" in back.radiance.attrs["rounding"]
    [term] = row.errors
    assert term.value == 2**-13
    grown = back.xyz_noise.values[0, 1] / plain.xyz_noise.values[0, 1]
    assert (grown >= 1.05).all() and (grown < 1.08).all()


def test_light_without_noise_is_as_it_was():
    ds = scene(np.zeros((40, 60))).drop_vars("xyz_noise")
    assert rounded_by_noise(ds) is ds
