"""Pictures for training, as the camera of a run sees them; tested without PyTorch."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_isp.spectra import light
from isethdr_workflows.training.picture.bank import bank, crop
from isethdr_workflows.training.picture.camera import camera_of
from isethdr_workflows.training.picture.leaves import WAVELENGTH_NM, LeavesRecipe, leaves
from isethdr_workflows.training.picture.settings import Settings
from isethdr_workflows.training.picture.sheets import Sheets, Source, joined, parted
from isethdr_workflows.training.picture.sources import check_size

from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import xyz_weights

GREY_NM = WAVELENGTH_NM


@pytest.fixture(scope="module")
def camera():
    """Return a camera with two readings of one charge."""
    return camera_of(["sensor=typical_bayer"])


def grey(camera, lux, side):
    """Return the planes (plane, y, x) of a grey of `lux` in the isp's daylight."""
    spectrum = light("daylight", GREY_NM)
    planes = camera.plane_weights(GREY_NM) @ (spectrum / (xyz_weights(GREY_NM)[1] @ spectrum))
    return np.broadcast_to(lux * planes[:, None, None], (len(planes), side, side))


@pytest.mark.parametrize("lux", [0.05, 5.0])
def test_a_daylight_grey_has_as_many_electrons_of_y_as_its_unit_channel_counts(camera, lux):
    side = 96
    planes = grey(camera, lux, side)
    samples = camera.shot(planes[:-3], GREY_NM, seed=3)
    unit = camera.masks(side, side)[camera.channels.index(camera.unit_channel)] == 1
    measured = samples.raw[0][unit]
    expected = lux * samples.unit_e_per_lux
    # four standard errors; PRNU of 0.5 % is part of the spread
    assert abs(measured.mean() - expected) < 4 * measured.std() / np.sqrt(measured.size)
    # The stated noise is that of the samples: Poisson noise and the noise added to it. A sample
    # variance of n values has a relative standard error of sqrt(2 / n), here 2 %. PRNU adds 0.5 %
    # of the level.
    stated = expected + np.mean(samples.noise[0][unit] ** 2)
    assert measured.var() == pytest.approx(stated + (0.005 * expected) ** 2, rel=0.1)
    assert samples.valid.all()


def test_the_device_changes_from_sheet_to_sheet_and_a_sheet_does_not(camera):
    recipe = LeavesRecipe(pictures=1, side_px=32)
    pictures = leaves(camera, recipe, 0)[None]
    sheets = Sheets(camera, (Source("leaves", pictures, WAVELENGTH_NM, 1.0),), 32, seed=1)
    first = sheets.sheet(4)
    again = sheets.sheet(4)
    assert all(np.array_equal(a, b) for a, b in zip(first, again))
    assert not np.array_equal(first.raw, sheets.sheet(5).raw)
    assert first.raw.shape == (16, 1, 32, 32) and first.truth.shape == (16, 3, 32, 32)
    assert all(np.isfinite(values).all() for values in first)


def test_patches_come_back_from_a_sheet():
    patches = np.arange(4 * 3 * 8 * 8, dtype=float).reshape(4, 3, 8, 8)
    assert np.array_equal(parted(joined(patches), 8), patches)


def test_leaves_have_one_lux_and_positive_planes(camera):
    planes = leaves(camera, LeavesRecipe(side_px=48), 2)
    assert planes[-2].mean() == pytest.approx(1.0, rel=1e-5)  # float32
    assert (planes > 0).all() and len(planes) == len(camera.channels) + 3


def test_a_bank_is_made_once_and_crops_stay_inside(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    made = []

    def picture(number):
        made.append(number)
        return np.full((2, 12, 20), number, np.float32)

    first = bank("test", {"of": "this"}, 3, picture)
    assert np.array_equal(bank("test", {"of": "this"}, 3, picture), first) and made == [0, 1, 2]
    first = np.array(first)
    file = next((tmp_path / "training" / "banks").iterdir())
    file.unlink()  # the old file is still mapped, so the test writes a new one
    file.write_bytes(b"damaged")
    assert np.array_equal(bank("test", {"of": "this"}, 3, picture), first)
    rng = np.random.default_rng(0)
    assert all(crop(first, 12, rng).shape == (2, 12, 12) for _ in range(20))


def test_sensors_that_cannot_be_learned_from_are_refused():
    with pytest.raises(ConfigError, match="unequal pixels"):
        camera_of(["sensor=interleaved"])
    with pytest.raises(ConfigError, match="has no noise.*type sensor.noise=true"):
        camera_of(["sensor=bayer", "sensor.noise=false"])
    with pytest.raises(ConfigError, match="has no noise.*type for example sensor=typical_bayer"):
        camera_of(["sensor=ideal"])


def test_pictures_of_two_sizes_are_refused_and_nothing_is_kept(isethdr_home):
    """Pictures of two sizes would be read from wrong places of the file."""
    with pytest.raises(ConfigError, match="picture 3 of the test has 8 x 4 pixels and .* 8 x 6"):
        bank("test", {"of": "two"}, 3, lambda k: np.zeros((2, 4 if k == 2 else 6, 8), np.float32))
    assert not [path for path in isethdr_home.rglob("*") if path.is_file()]


def test_roads_smaller_than_a_patch_are_refused():
    roads = np.zeros((2, 5, 90, 160), np.float32)
    with pytest.raises(ConfigError, match="160 x 90 pixels.*patch_px=128.*type patch_px=80"):
        check_size(roads, Settings(dataset="tiny", steps=1))
    check_size(roads, Settings(dataset="tiny", steps=1, patch_px=80))
