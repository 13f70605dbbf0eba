"""Lateral colour: position and light of every band, refusals, and the light on the sensor."""

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens, PrescribedLens
from isethdr_optics.field import retiling
from isethdr_optics.field.lateral_colour import magnified

from isethdr_core.data import camera_geometry, quantities
from isethdr_core.errors import ConfigError
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.render_noise import direct_share, on_light

TABLE = {450: 0.6, 550: 0.0, 650: -0.8}
BANDS = (450.0, 500.0, 550.0, 650.0)
SCALES = (1.006, 1.003, 1.0, 0.992)
PITCH = 0.005


def field(values, **attrs):
    height, width = values.shape
    x = quantities.centres(width, width * PITCH)
    y = quantities.centres(height, height * PITCH)
    planes = np.broadcast_to(values, (len(BANDS), height, width)).astype(np.float32)
    return quantities.plane(planes, list(BANDS), x, y, quantities.RADIANCE, **attrs)


def lamp(row=80, column=110):
    values = np.zeros((96, 128))
    values[row, column] = 7.0
    return field(values)


@pytest.mark.parametrize(
    "distortion", ["none", {"model": "brown_conrady", "k1": -0.2}], ids=["straight", "barrel"]
)
def test_a_lamp_moves_by_its_height_times_the_magnification_and_keeps_its_light(distortion):
    scene = lamp()
    lens = IdealLens(lateral_colour_percent=TABLE, falloff="none", distortion=distortion)
    light = lens(scene)
    plain = IdealLens(falloff="none", distortion=distortion)(scene)
    sums, known = (a.values.sum(axis=(1, 2), dtype=float) for a in (light, plain))
    np.testing.assert_allclose(sums, known, rtol=1e-6)  # rounding to float32
    assert light.values.min() >= 0
    centre = {
        d: float(plain.values[0].sum(axis=a, dtype=float) @ plain[d].values) / known[0]
        for d, a in (("x", 0), ("y", 1))
    }
    for b, scale in enumerate(SCALES):
        for d, a in (("x", 0), ("y", 1)):
            at = float(light.values[b].sum(axis=a, dtype=float) @ light[d].values) / sums[b]
            # Light of a tile is uniform and shared by area. Shared by two tiles, its centroid is
            # off by at most an eighth of a tile; shared by three tiles (barrel distortion), by a
            # quarter.
            allowed = (0.13 if distortion == "none" else 0.26) * PITCH * 4e-3
            assert abs(at - scale * centre[d]) < allowed, (b, d)
    moved = [abs(s - 1) * abs(centre["x"]) for s in SCALES]
    assert max(moved) > 0.3 * PITCH * 4e-3  # the shift is large enough to be measured


def test_uniform_light_thins_out_as_the_image_grows():
    light = IdealLens(lateral_colour_percent=TABLE, falloff="none")(field(np.full((96, 128), 2.0)))
    # the largest image needs one more tile on each side, the smallest ends half a tile earlier
    inner = light.values[:, 2:-2, 2:-2]
    want = 2.0 * light.attrs["throughput_sr"] / np.square(SCALES)
    # rounding to float32
    np.testing.assert_allclose(inner, np.broadcast_to(want[:, None, None], inner.shape), rtol=1e-6)


def test_magnified_is_exact_for_any_scale():
    """Compare with the overlap of each pair of tiles, summed in plain loops over one axis."""
    values = np.random.default_rng(3).random(41)
    for scale, count in ((0.953, 39), (0.999, 39), (1.0, 41), (1.0004, 41), (1.049, 41)):
        want = np.zeros(count)
        for j in range(count):
            for i in range(41):
                low = max((i - 20.5) * scale, j - count / 2)
                high = min((i - 19.5) * scale, j + 1 - count / 2)
                want[j] += values[i] * max(high - low, 0.0) / scale
        got = magnified(np.outer(values, np.ones(3)), scale, (count, 3))[:, 1]
        np.testing.assert_allclose(got, want / scale, rtol=1e-12)


def test_nothing_is_resampled_without_and_labels_follow_the_reference(monkeypatch):
    scene = lamp()
    light = IdealLens(lateral_colour_percent=TABLE)(scene)
    assert camera_geometry.map_of(light) == camera_geometry.Identity()
    # the grid is not finer; the tiles are the same
    np.testing.assert_allclose(light.x.values[1:-1] / 4e-3, scene.x.values, rtol=1e-9)
    # the largest image is 0.6 % larger: less than one tile on each side
    assert light.sizes["x"] == 130 and light.sizes["y"] == 98
    # the field that all bands cover, to less than a tile
    assert light.attrs["field_width"] == pytest.approx(0.992 * 128 * PITCH * 4e-3)
    np.testing.assert_allclose(light.values[2, 1:-1, 1:-1], IdealLens()(scene).values[2], rtol=1e-6)
    # calling it would fail
    monkeypatch.setattr("isethdr_optics.field.lateral_colour.magnified", None)
    for none in ({}, {400: 0.0, 700: 0.0}):
        np.testing.assert_array_equal(
            IdealLens(lateral_colour_percent=none)(scene).values, IdealLens()(scene).values
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [
        IdealLens,
        lambda **k: PrescribedLens(
            wavefront="none", distortion="none", **k | {"lateral_colour_percent": {}}
        ),
    ],
    ids=["table", "traced"],
)
def test_no_light_leaves_at_the_border(make):
    """Energy conservation with light up to the border and lamps in a corner and at an edge.

    A band that is magnified gets more tiles, so that none of its light leaves the image.
    """
    values = np.random.default_rng(7).uniform(0.5, 1.5, (30, 40))
    values[0, 0] = values[-1, 17] = 1e5
    moved, still = (
        make(lateral_colour_percent=table, falloff="none", **traced)(field(values))
        for table, traced in (
            (TABLE, {}),
            ({}, {} if make is IdealLens else {"lateral_colour": "none"}),
        )
    )
    assert not np.array_equal(moved.values[0], moved.values[-1])
    before, after = (i.values.sum(axis=(1, 2), dtype=float) for i in (still, moved))
    # rounding to float32; both images lose the same light by diffraction beyond the frame
    np.testing.assert_allclose(after, before, rtol=2e-7)


@pytest.mark.parametrize(
    "distortion", ["none", {"model": "brown_conrady", "k1": -0.2}], ids=["straight", "barrel"]
)
def test_tiles_that_the_sensor_plane_has_more_are_like_the_border_s(distortion):
    """Map a field to the whole sensor plane, as `scene_noise` does.

    Tiles beyond the image without lateral colour take the value of the border tile.
    """
    values = np.random.default_rng(2).uniform(0.5, 1.5, (96, 128))
    mixed = field(values)
    lens = IdealLens(lateral_colour_percent=TABLE, falloff="none", distortion=distortion)
    light = lens(mixed)
    still = IdealLens(falloff="none", distortion=distortion)(mixed)
    seen = on_light(values, mixed, light)
    known = on_light(values, mixed, still)
    assert seen.shape == light.shape[1:] and light.sizes["x"] > still.sizes["x"]
    more = [(light.sizes[d] - still.sizes[d]) // 2 for d in ("y", "x")]
    inner = seen[more[0] : -more[0] or None, more[1] : -more[1] or None]
    np.testing.assert_allclose(inner, known, rtol=1e-9)  # rounding of borders
    # each value is a mean of tiles, border tiles included
    assert values.min() <= seen.min() and seen.max() <= values.max()
    if distortion == "none":
        # the additional tile equals its neighbour
        np.testing.assert_allclose(seen[:, 0], seen[:, 1], rtol=1e-9)
    share = direct_share(light, mixed)
    assert (0 <= share).all() and (share <= 1).all() and np.median(share) > 0.9


def test_a_margin_keeps_the_camera_s_field():
    light = IdealLens(lateral_colour_percent=TABLE)(
        field(np.ones((96, 128)), field_width=110 * PITCH, field_height=80 * PITCH)
    )
    assert light.attrs["field_width"] == pytest.approx(110 * PITCH * 4e-3)


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(DiffractionLimitedLens, id="thin"),
        pytest.param(
            lambda **k: PrescribedLens(wavefront="none", **k), id="traced", marks=pytest.mark.slow
        ),
    ],
)
def test_other_lenses_too_and_the_ledger_says_so(make):
    rows = ledger.Ledger()
    values = np.full((24, 32), 1.0)
    with ledger.stage(rows, "lens"):
        light = make(lateral_colour_percent=TABLE)(field(values))
    assert np.isfinite(light.values).all() and light.attrs["field_width"] < 32 * PITCH * 4e-3
    [within] = [o for o in rows[0].left_out if "within a band" in o.what]
    # the corner is 20 tiles from the centre; bands are about 75 nm wide
    assert within.bound == pytest.approx(20 * 0.0045 / 50 * 75, rel=0.5)


def test_what_border_tiles_lack_is_an_error_of_those_tiles_alone():
    still = IdealLens(falloff="none")
    tiny = IdealLens(falloff="none", lateral_colour_percent={450: 0.0, 650: -1e-3})
    values = field(np.full((48, 64), 2.0))
    with ledger.stage(rows := ledger.Ledger(), "lens"):
        light = tiny(values)
    [note] = [e for e in rows[0].errors if e.part == retiling.BORDER]
    declared = rows[0].light_parts[retiling.BORDER].light
    off = np.abs(light.values / still(values).values - 1)
    # the error of a corner tile, summed over both axes
    assert note.value == pytest.approx((32 + 24) * 1e-5, rel=1e-3)
    assert off.max() == pytest.approx(note.value, rel=0.1)
    # an image that is 1e-5 smaller is 2e-5 brighter; the rest is rounding to float32
    assert np.all(off <= note.value * (declared.values > 0) + 2.1e-5)
    assert np.mean(declared.values > 0) < 0.2


def test_bad_input():
    with pytest.raises(ConfigError, match="450 to 600 nm"):
        IdealLens(lateral_colour_percent={450: 0.1, 600: 0.2})(lamp())
    with pytest.raises(ConfigError, match="with 7.0 in it; expected -5 to 5"):
        IdealLens(lateral_colour_percent={450: 7.0})
