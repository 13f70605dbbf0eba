"""Reference picture: exact area means of the radiance over the pixels, labels at pixel centres,
boxes in pixels.
"""

import numpy as np
import pytest
import xarray as xr

from isethdr_core.data import quantities as q
from isethdr_core.data.reference_picture import FIXED_PATTERN, check_developed
from isethdr_core.errors import UnitError
from isethdr_core.physics.photometry import xyz
from isethdr_core.truth import check_picture, labels_on, make_picture, objects_on, truth

FOCAL_MM = 4.0
PITCH_UM = 3.0
W = np.array([450.0, 550.0, 650.0])


def blank(ny=6, nx=8, pitch=PITCH_UM):
    zeros = np.zeros((ny, nx, 3))
    step = pitch * 1e-6
    return make_picture(
        zeros,
        zeros,
        np.ones((ny, nx)),
        q.centres(nx, nx * step),
        q.centres(ny, ny * step),
        focal_length_mm=FOCAL_MM,
        pitch_um=pitch,
    )


def cube(values, pixels_per_tile=1.0):
    """Return mixed radiance whose tiles are `pixels_per_tile` pixels wide."""
    _, ny, nx = values.shape
    tile = pixels_per_tile * PITCH_UM * 1e-3 / FOCAL_MM
    return q.plane(values, W, q.centres(nx, nx * tile), q.centres(ny, ny * tile), q.RADIANCE)


def test_one_tile_per_pixel_is_the_photometry_of_that_tile():
    radiance = np.random.default_rng(0).uniform(0, 1e4, (3, 6, 8))
    result = truth(cube(radiance), blank())
    np.testing.assert_allclose(result.xyz.values, xyz(radiance, W), rtol=1e-12)
    assert not result.variance.values.any() and result.valid.values.all()
    check_picture(result)


def test_finer_tiles_are_averaged_exactly():
    radiance = np.random.default_rng(1).uniform(0, 1, (3, 18, 24))
    result = truth(cube(radiance, 1 / 3), blank())
    blocks = radiance.reshape(3, 6, 3, 8, 3).mean((2, 4))
    np.testing.assert_allclose(result.xyz.values, xyz(blocks, W), rtol=1e-11)


def test_light_is_conserved_on_any_grid():
    radiance = np.random.default_rng(2).uniform(0, 1, (3, 11, 7))
    tiles = cube(radiance, 7.3)
    grid = blank(ny=int(11 * 7.3), nx=int(7 * 7.3))
    inside = truth(tiles, grid).xyz.values[..., 1]

    # expected integral over the pixels: the overlap of tiles and frame is separable, and computed
    # here for one dimension at a time
    def share(count, pixels):
        edges = (np.arange(count + 1) - count / 2) * 7.3
        return np.clip(np.diff(np.clip(edges, -pixels / 2, pixels / 2)), 0, None)

    expected = share(11, inside.shape[0]) @ xyz(radiance, W)[..., 1] @ share(7, inside.shape[1])
    assert inside.sum() == pytest.approx(expected, rel=1e-12)


def test_twelve_decades_side_by_side_do_not_touch():
    radiance = np.full((3, 6, 8), 1e-6, np.float32)
    radiance[:, 3, 4] = 1e6
    y = truth(cube(radiance), blank()).xyz.values[..., 1]
    dark = float(xyz(np.full((3, 1, 1), np.float32(1e-6)), W)[0, 0, 1])
    # a tile overlaps a neighbouring pixel only by rounding of the grid: 1e-16 of a tile. With
    # light 1e12 times as bright, this adds 1e-4 to a dark pixel
    assert np.delete(y.ravel(), 3 * 8 + 4).max() == pytest.approx(dark, rel=1e-2)


def scene(instance, objects):
    ny, nx = instance.shape
    tile = 0.5 * PITCH_UM * 1e-3 / FOCAL_MM
    ds = q.scene_radiance(
        np.ones((1, 3, ny, nx)),
        ["other"],
        W,
        q.centres(nx, nx * tile),
        q.centres(ny, ny * tile),
        instance=instance.astype(np.uint32),
    )
    ds.attrs["objects"], ds.attrs["lamps"] = objects, [{"object": "lamp"}]
    return ds


def test_labels_come_from_the_tile_under_the_pixel_centre():
    instance = np.arange(18 * 22).reshape(18, 22)  # tiles of half a pixel: 9 x 11 pixels
    labels = labels_on(scene(instance, []), blank(ny=3, nx=5))
    assert labels["instance"].shape == (3, 5) and labels["instance"].dtype == np.uint32
    assert "radiance" not in labels and labels.attrs["lamps"]
    # neighbouring pixels are two tiles apart in both directions, and all lie in the middle of the
    # frame
    assert set(np.diff(labels["instance"].values, axis=1).ravel()) == {2}
    assert set(np.diff(labels["instance"].values, axis=0).ravel()) == {44}
    assert abs(float(labels["instance"].values[1, 2]) - instance[8:10, 10:12].mean()) < 12


def test_boxes_are_in_pixels_of_the_picture():
    boxes = [
        {"instance": 1, "name": "all", "box": [0, 0, 16, 12]},
        {"instance": 2, "name": "corner", "box": [-4, 2, 8, 4]},
        {"instance": 3, "name": "outside", "box": [40, 0, 2, 2]},
    ]
    found = objects_on(scene(np.ones((12, 16)), boxes), blank())
    assert [o["name"] for o in found] == ["all", "corner"]
    np.testing.assert_allclose(found[0]["box"], [0, 0, 8, 6], atol=1e-9)
    np.testing.assert_allclose(found[1]["box"], [0, 1, 2, 2], atol=1e-9)
    assert found[0]["in_frame"] == pytest.approx(1) and found[1]["in_frame"] == pytest.approx(0.5)


def test_the_whole_box_is_cut_at_the_frame_and_the_rest_is_truncation():
    """The picture has 8 x 6 pixels of 2 x 2 tiles. Half of the second object is left of it."""
    boxes = [
        {"instance": 1, "name": "all", "box": [2, 2, 4, 4], "box_full": [2.0, 1.0, 6.0, 6.0]},
        {"instance": 2, "name": "left", "box": [0, 2, 4, 4], "box_full": [-4.0, 2.0, 8.0, 4.0]},
    ]
    found = objects_on(scene(np.ones((12, 16)), boxes), blank())
    np.testing.assert_allclose(found[0]["box_full"], [1, 0.5, 3, 3], atol=1e-9)
    np.testing.assert_allclose(found[1]["box_full"], [0, 1, 2, 2], atol=1e-9)
    assert [o["truncation"] for o in found] == pytest.approx([0.0, 0.5], abs=1e-12)


def test_motion_is_in_pixels_of_the_picture():
    """A motion of two pixels to the right and one up is stated in tangents.

    Through a distorting lens, the motion leads from the image of its start to the image of its end,
    by the formula of Brown (1966) with the term r^2 only.
    """
    pixel = PITCH_UM * 1e-3 / FOCAL_MM
    moving = scene(np.ones((12, 16)), [])
    moving["motion"] = (("y", "x", "uv"), np.full((12, 16, 2), (2 * pixel, -pixel), np.float32))
    motion = labels_on(moving, blank())["motion"]
    assert motion.attrs["units"] == "px" and motion.dims == ("y", "x", "uv")
    np.testing.assert_allclose(motion.values[..., 0], 2.0, rtol=1e-6)  # float32
    np.testing.assert_allclose(motion.values[..., 1], -1.0, rtol=1e-6)
    picture = blank(ny=4, nx=6)
    k1 = 1000.0
    picture.attrs["distortion"] = {"model": "brown_conrady", "k1": k1}
    found = labels_on(moving, picture)["motion"].values
    x, y = np.meshgrid(moving.x.values, moving.y.values)
    ends = [(x + 2 * pixel * moved, y - pixel * moved) for moved in (0, 1)]
    images = [np.stack((u, v), -1) * (1 + k1 * (u**2 + v**2))[..., None] for u, v in ends]
    way = (images[1] - images[0]) / pixel
    # each pixel shows the motion of one of the tiles
    apart = np.abs(found[:, :, None, None] - way).max(-1)
    assert apart.min((2, 3)).max() < 1e-5
    assert np.ptp(found[..., 0]) > 0.02


@pytest.mark.parametrize(
    ("distortion", "far_is_lost"),
    [
        ({"model": "brown_conrady", "k1": -0.1}, False),
        ({"model": "kannala_brandt", "k1": -0.02}, False),
        ({"model": "table", "angle_deg": [1, 2], "radius_per_focal_length": [0.0174, 0.034]}, True),
    ],
)
def test_motion_to_where_a_lens_images_nothing_is_not_known(distortion, far_is_lost):
    moving = scene(np.ones((12, 16)), [])
    motion = np.full((12, 16, 2), 1e-4, np.float32)
    motion[:, :8] = np.nan  # behind the camera in the next frame
    motion[:6, 8:] = 0.1  # beyond the table of angles
    moving["motion"] = (("y", "x", "uv"), motion)
    picture = blank(ny=4, nx=6)
    picture.attrs["distortion"] = distortion
    found = np.isfinite(labels_on(moving, picture)["motion"].values).all(-1)
    assert not found[:, :3].any() and found[2:, 3:].all()
    assert found[:2, 3:].any() != far_is_lost


def test_bad_input_is_named():
    with pytest.raises(UnitError, match="do not fit the scene"):
        truth(cube(np.ones((3, 4, 4))), blank())
    with pytest.raises(UnitError, match="widen the camera"):
        labels_on(scene(np.ones((4, 4)), []), blank(ny=20, nx=20))
    with pytest.raises(UnitError, match="focal_length_mm"):
        make_picture(
            np.zeros((1, 1, 3)), np.zeros((1, 1, 3)), np.ones((1, 1)), [0.0], [0.0], pitch_um=3.0
        )
    with pytest.raises(UnitError, match="'variance'"):
        check_picture(blank().drop_vars("variance"))
    with pytest.raises(UnitError, match="no variable"):
        check_picture(xr.DataArray(1.0))
    bare = blank()
    del bare.attrs["pitch_um"]
    with pytest.raises(UnitError, match="pitch_um"):
        truth(cube(np.ones((3, 6, 8))), bare)


def spoiled(**values):
    """Return a picture with other values in its first pixel."""
    picture = blank().copy(deep=True)
    picture[FIXED_PATTERN] = picture["variance"].copy()
    for name, value in values.items():
        picture[name].values[0, 0] = value
    return picture


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (spoiled(xyz=np.nan), "has xyz nan in 1 valid pixel; expected finite values; set valid to"),
        (spoiled(xyz=-np.inf), "has xyz -inf in 1 valid pixel"),
        (
            spoiled(variance=-1.0),
            "has variance -1 in 1 valid pixel; expected .* 0 or more; .*False",
        ),
        (spoiled(variance=np.nan), "has variance nan in 1 valid pixel"),
        (spoiled(**{FIXED_PATTERN: np.nan}), f"has {FIXED_PATTERN} nan in 1 valid pixel"),
        (
            blank().isel(xyz_channel=[2, 1, 0]),
            "has xyz_channel .'Z', 'Y', 'X'.; expected .'X', 'Y'",
        ),
        (blank().drop_vars("xyz_channel"), r"has xyz_channel \[\]; expected"),
        (
            blank().assign(valid=blank().valid.astype("f4")),
            "has valid of type float32 .*expected bo",
        ),
        (blank().drop_vars("valid"), "has no variable 'valid'"),
        (None, "has no variable 'xyz'"),
    ],
)
def test_a_picture_that_cannot_be_scored_is_refused_with_its_isp(picture, message):
    with pytest.raises(UnitError, match=f"the picture of isp Own {message}") as told:
        check_developed(picture, "the picture of isp Own")
    assert "\n" not in str(told.value)


def test_values_that_no_score_uses_may_be_unknown():
    check_developed(blank(), "picture")
    check_developed(blank().isel(y=slice(0)), "picture")
    check_developed(spoiled(xyz=np.nan, variance=np.nan, valid=False), "picture")
    check_developed(spoiled(**{FIXED_PATTERN: -1.0}), "picture")
    unknown = spoiled(variance=np.nan, **{FIXED_PATTERN: np.nan})
    check_developed(unknown.assign_attrs(variance_known=False), "picture")
