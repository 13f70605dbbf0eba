"""Sensor plane: distortion, relative illumination, wide fields; reference picture and labels with
the same distortion.
"""

import numpy as np
import pytest
from isethdr_optics import IdealLens, PrescribedLens
from isethdr_optics.imaging.sensor_plane import sensor_plane

from isethdr_core.data import camera_geometry, quantities
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.truth import labels_on, make_picture, truth
from isethdr_core.uncertainty import ledger

BARREL = {"model": "brown_conrady", "k1": -0.2}
PINCUSHION = {"model": "brown_conrady", "k1": 0.1, "p1": 1e-3}
FISHEYE = {"model": "kannala_brandt", "k1": -0.02}
TABLE = {
    "model": "table",
    "angle_deg": [10, 20, 30, 45],
    "radius_per_focal_length": [0.1745, 0.347, 0.517, 0.765],
}


def field(values=None, width=64, height=48, pitch=0.015, bands=(500.0, 600.0), **attrs):
    shape = (len(bands), height, width)
    values = np.ones(shape) if values is None else np.broadcast_to(values, shape)
    x = quantities.centres(width, width * pitch)
    y = quantities.centres(height, height * pitch)
    return quantities.plane(
        values.astype(np.float32), list(bands), x, y, quantities.RADIANCE, **attrs
    )


def noise(seed=1, **attrs):
    return field(np.random.default_rng(seed).random((2, 48, 64)), **attrs)


def noted(call):
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        result = call()
    return result, rows[0]


def test_an_unknown_falloff_does_not_count_as_none():
    with pytest.raises(UnitError, match="falloff 'cos' is unknown; did you mean 'cos4'"):
        camera_geometry.relative_illumination({"falloff": "cos"}, 0.1, 0.0)


def flux(light):
    return (
        light.values.sum(axis=(1, 2), dtype=float)
        * quantities.tile_pitch(light, "x")
        * quantities.tile_pitch(light, "y")
    )


@pytest.mark.parametrize(
    "zero", ["none", {"model": "brown_conrady"}, {"model": "brown_conrady", "k1": 0.0}]
)
def test_without_distortion_nothing_is_resampled(zero, monkeypatch):
    plain = IdealLens()(noise())
    monkeypatch.setattr(camera_geometry, "overlap_areas", None)  # calling it would fail
    light, row = noted(lambda: IdealLens(distortion=zero)(noise()))
    np.testing.assert_array_equal(light.values, plain.values)
    assert light.attrs == plain.attrs and "distortion" not in light.attrs
    [left] = [o for o in row.left_out if "distortion" in o.what]
    assert 0 < left.bound < 1e-6  # the bound is the rounding of a resampling that changes nothing


def test_forcing_the_resampling_in_changes_nothing_beyond_its_bound(monkeypatch):
    """Resample with a distortion polynomial that is the identity in double precision."""
    plain = IdealLens()(noise())
    forced = IdealLens(distortion={"model": "brown_conrady", "k1": 1e-15})(noise())
    assert forced.attrs["distortion"]["k1"] == 1e-15
    np.testing.assert_allclose(forced.values, plain.values, rtol=2e-7)  # one rounding to float32


@pytest.mark.parametrize(
    "distortion", [BARREL, PINCUSHION, FISHEYE, TABLE], ids=lambda d: d["model"]
)
def test_the_light_of_a_lamp_is_kept_and_lands_on_its_image(distortion):
    values = np.zeros((48, 64))
    values[33, 45] = 7.0
    lens = IdealLens(distortion=distortion, falloff="none")
    light = lens(field(values))
    scene = field(values)
    # rounding to float32
    np.testing.assert_allclose(flux(light), flux(IdealLens(falloff="none")(scene)), rtol=1e-6)
    assert light.values.min() >= 0
    x, y = camera_geometry.map_of(light).forward(float(scene.x[45]), float(scene.y[33]))
    f_m = 4e-3
    total = light.values[0].sum()
    # a quarter of a tile: light of the tile is spread over at most four tiles
    assert abs(light.values[0].sum(axis=0) @ light.x.values / total / f_m - x) < 0.25 * 0.015
    assert abs(light.values[0].sum(axis=1) @ light.y.values / total / f_m - y) < 0.25 * 0.015


UNEVEN = {0: 1.0, 20: 0.8, 45: 0.4}


# the quick tests cover every model with one falloff and every falloff with one model; the other
# pairs are marked slow
@pytest.mark.parametrize(
    ("distortion", "falloff"),
    [
        pytest.param(d, f, marks=[pytest.mark.slow] * (f != "cos4" and d is not BARREL))
        for d in (BARREL, PINCUSHION, FISHEYE, TABLE)
        for f in ("cos4", "none", UNEVEN)
    ],
    ids=lambda part: part.get("model", "table") if isinstance(part, dict) else part,
)
def test_uniform_light_follows_the_relative_illumination_that_is_stated(distortion, falloff):
    light, row = noted(lambda: IdealLens(distortion=distortion, falloff=falloff)(field(2.0)))
    x, y = (light[d].values / 4e-3 for d in ("x", "y"))
    stated = camera_geometry.relative_illumination(light.attrs, x[None, :], y[:, None])
    measured = light.values[0] / (2.0 * light.attrs["throughput_sr"])
    error = next(e.value for e in row.errors if "uniform" in e.label)
    # the 1e-6 is for rounding to float32; the stated error is at most a quarter of the change of
    # cos4 over a tile of 0.015
    np.testing.assert_allclose(measured, stated, atol=(error + 1e-6) * stated.max())
    assert error < 3e-3
    if isinstance(falloff, dict):  # the table holds on the sensor, also under distortion
        u, v = camera_geometry.map_of(light).inverse(*np.meshgrid(x, y))
        wanted = camera_geometry.table_values(
            light.attrs["falloff_table"], np.degrees(np.arctan(np.hypot(u, v)))
        )
        np.testing.assert_allclose(measured, wanted, rtol=3e-3)


def test_a_tables_values_are_those_typed():
    light = IdealLens(falloff={0: 1.0, 10: 0.9, 40: 0.5})(field(width=65))
    at = np.degrees(np.arctan(np.hypot(light.x.values[None], light.y.values[:, None]) / 4e-3))
    near = np.abs(at - 10) < 0.2
    assert near.any()
    # the table falls by 0.013 to 0.015 per degree, times 0.2 degrees
    np.testing.assert_allclose(
        (light.values[0] / light.attrs["throughput_sr"])[near], 0.9, atol=0.005
    )


def test_only_known_light_is_looked_at():
    for distortion in (BARREL, PINCUSHION, FISHEYE):
        scene = noise(field_width=0.8, field_height=0.6)
        light = IdealLens(distortion=distortion)(scene)
        lens = camera_geometry.map_of(light)
        half_x = 64 * 0.015 / 2
        half_y = 48 * 0.015 / 2
        x, y = (np.abs(light[d].values).max() / 4e-3 + 0.0075 for d in ("x", "y"))
        u, v = lens.inverse(np.array([x, x, 0.0]), np.array([y, 0.0, y]))
        assert np.abs(u).max() <= half_x * (1 + 1e-9) and np.abs(v).max() <= half_y * (1 + 1e-9)
        # and the image is no smaller than needed
        assert np.abs(u).max() > half_x - 3 * 0.015 or np.abs(v).max() > half_y - 3 * 0.015
        w = light.attrs["field_width"] / 4e-3 / 2
        h = light.attrs["field_height"] / 4e-3 / 2
        u, v = lens.inverse(np.array([w, w, 0.0]), np.array([h, 0.0, h]))
        assert np.abs(u).max() <= 0.4 * (1 + 1e-6) and np.abs(v).max() <= 0.3 * (1 + 1e-6)


def pictured(light, pitch_um=30.0):
    """Return an empty picture over the field of `light`, with the attributes that sensor and isp
    hand on.
    """
    rows, columns = (
        int(light.attrs[k] / (pitch_um * 1e-6)) for k in ("field_height", "field_width")
    )
    x, y = (quantities.centres(n, n * pitch_um * 1e-6) for n in (columns, rows))
    zero = np.zeros((rows, columns, 3))
    places = {k: light.attrs[k] for k in camera_geometry.PLACES if k in light.attrs}
    return make_picture(
        zero,
        zero,
        np.ones((rows, columns), bool),
        x,
        y,
        focal_length_mm=4.0,
        pitch_um=pitch_um,
        **places,
    )


@pytest.mark.parametrize(
    ("distortion", "projection"),
    [(BARREL, "tangent"), (FISHEYE, "tangent"), (FISHEYE, "equidistant"), (TABLE, "equidistant")],
)
def test_truth_and_labels_lie_where_the_light_is(distortion, projection):
    from scipy.ndimage import binary_dilation, binary_erosion

    from isethdr_core.physics.resampling.area import resample_mean

    width = 192
    height = 144
    pitch = 0.005
    ids = np.zeros((height, width), np.uint32)
    ids[20:50, 130:170] = 1
    ids[90:130, 20:60] = 2
    cube = np.where(ids > 0, ids * 3.0, 0.5)[None, None] * np.ones((1, 3, 1, 1))
    x = quantities.centres(width, width * pitch)
    y = quantities.centres(height, height * pitch)
    scene = quantities.scene_radiance(
        cube, ["sky"], [500.0, 550.0, 600.0], x, y, projection=projection, instance=ids
    )
    scene.attrs["objects"] = [
        {"instance": 1, "box": [130, 20, 40, 30]},
        {"instance": 2, "box": [20, 90, 40, 40]},
    ]
    more = {"projection": projection} if projection != "tangent" else {}
    mixed = quantities.plane(
        cube[0].astype(np.float32), [500.0, 550.0, 600.0], x, y, quantities.RADIANCE, **more
    )
    light = IdealLens(distortion=distortion, falloff="none")(mixed)
    picture = pictured(light, 20.0)
    true = truth(mixed, picture)
    labels = labels_on(scene, picture)
    found = labels["instance"].values
    assert (
        true.attrs["distortion"] == light.attrs["distortion"]
        and found.dtype == np.uint32
        and set(np.unique(found)) == {0, 1, 2}
    )
    # the reference picture is radiance: inside each object and the ground it equals that of the
    # scene, under any distortion
    y_of = quantities.tristimulus(mixed)["xyz"].values[..., 1]
    for number in (0, 1, 2):
        inside = binary_erosion(found == number, np.ones((3, 3)))
        want = y_of[ids == number][0]
        np.testing.assert_allclose(true["xyz"].values[inside][:, 1], want, rtol=1e-6)
    # the picture of a noiseless camera over the stated relative illumination is the reference
    # picture
    f_m = 4e-3
    seen = resample_mean(
        light.values[:1],
        light.x.values,
        light.y.values,
        picture.x.values,
        picture.y.values,
        20e-6,
        20e-6,
    )[0]
    flat = camera_geometry.relative_illumination(
        light.attrs, picture.x.values[None, :] / f_m, picture.y.values[:, None] / f_m
    )
    radiance = seen / (flat * light.attrs["throughput_sr"])
    share = true["xyz"].values[..., 1] / y_of[ids == 1][0] * 3.0
    # 5 % of the pixels may differ: tiles and pixels blur the borders of objects
    assert (
        np.median(np.abs(radiance - share)) < 1e-4
        and np.mean(np.abs(radiance - share) > 0.3) < 0.05
    )
    for number in (
        1,
        2,
        # a quarter of a pixel: the centroid of about 1000 pixels, where each pixel on the border
        # may belong to either side
    ):
        lit = binary_dilation(found == number, iterations=8) & (radiance > (0.5 + 3.0 * number) / 2)
        there, said = (np.mean(np.nonzero(mask), axis=1) for mask in (lit, found == number))
        assert np.abs(there - said).max() < 0.25
    for entry in labels.attrs["objects"]:
        rows, columns = np.nonzero(found == entry["instance"])
        left, top, wide, high = entry["box"]
        assert abs(left - columns.min()) <= 1 and abs(left + wide - columns.max() - 1) <= 1
        assert abs(top - rows.min()) <= 1 and abs(top + high - rows.max() - 1) <= 1


def test_a_picture_of_another_projection_is_refused():
    mixed = noise()
    light = IdealLens(falloff="none")(noise(projection="equidistant"))
    with pytest.raises(UnitError, match="projection"):
        truth(mixed, pictured(light))


def test_an_equidistant_field_beyond_90_degrees():
    scene = field(3.0, width=120, height=80, pitch=np.pi / 120, projection="equidistant")
    light = IdealLens(falloff="none")(scene)
    np.testing.assert_allclose(light.values, 3.0 * light.attrs["throughput_sr"], rtol=1e-6)
    assert light.attrs["projection"] == "equidistant"
    assert light.x.values[-1] == pytest.approx(4e-3 * np.radians(90) * 119 / 120)
    bent = IdealLens(falloff={0: 1, 115: 0.5}, distortion={"model": "kannala_brandt", "k1": -0.01})(
        scene
    )
    assert bent.values.min() > 0
    with pytest.raises(ConfigError, match="falloff"):
        IdealLens()(scene)
    with pytest.raises(ConfigError, match="below 90"):
        IdealLens(falloff="none", distortion=BARREL)(scene)


def test_tangents_and_angles_give_the_same_picture():
    """Compare the image of a fisheye lens for a tangent and an equidistant field."""
    lens = IdealLens(distortion=FISHEYE, falloff="cos4")
    by_tangent = lens(field(width=200, height=200, pitch=2 / 200))
    by_angle = lens(field(width=200, height=200, pitch=2 / 200, projection="equidistant"))
    a, b = (v.values[0][v.sizes["y"] // 2] for v in (by_tangent, by_angle))
    n = min(len(a), len(b))
    a, b = (v[(len(v) - n) // 2 : (len(v) - n) // 2 + n] for v in (a, b))
    # 2.5e-3: cos4 and the map are evaluated at the centres of tiles of 0.01
    np.testing.assert_allclose(a, b, rtol=2.5e-3)


@pytest.mark.slow
def test_the_prescriptions_distortion_and_illumination_are_those_of_its_rays():
    from isethdr_optics.prescription.figures import chief_mm, relative_illumination

    lens = PrescribedLens(f_number=5.6)
    scene = field(width=80, height=60, pitch=0.005)
    plane = sensor_plane(lens, scene)
    tangent = np.linspace(0.005, 0.245, 40)
    bent = camera_geometry.distortion_map(plane.attrs["distortion"])
    real = lens.real()
    # a cubic spline over 33 points of a smooth curve errs by 1e-7
    np.testing.assert_allclose(
        bent.forward(tangent, 0.0)[0], chief_mm(real, tangent, real.reference_nm) / 4.0, rtol=1e-5
    )
    angle = np.degrees(np.arctan(tangent))
    stated = camera_geometry.table_values(plane.attrs["falloff_table"], angle)
    # 2e-3: 160 cells across the beam
    np.testing.assert_allclose(stated, relative_illumination(real, tangent), rtol=2e-3)
    light = IdealLens(falloff="none")(scene)
    # the plane as it is before lateral colour magnifies the bands
    assert plane.attrs["falloff"] == "table" and plane.unmagnified_shape[1] < light.sizes["x"]


def test_added_light_falls_on_the_sensors_own_tiles():
    class Veil:
        def irradiance(self, lens, mixed):
            f_m = lens.focal_length_mm * 1e-3
            x = mixed.x.values * f_m
            y = mixed.y.values * f_m
            values = np.broadcast_to(x[None, None, :] + 1.0, mixed.shape)
            return quantities.plane(values, mixed.wavelength.values, x, y, quantities.IRRADIANCE)

    for distortion in (BARREL, {"model": "brown_conrady", "k1": 0.3}):
        lens = IdealLens(distortion=distortion)
        dark = field(0.0)
        light = lens(dark, flares=[Veil()])
        np.testing.assert_allclose(light.values[0, 5], light.x.values + 1.0, rtol=1e-6)
    # pincushion: the sensor is larger than the field's image without distortion
    assert light.sizes["x"] > 64


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"distortion": {"model": "brown_conradi"}}, "did you mean 'brown_conrady'"),
        ({"distortion": {"k1": 0.1}}, "has model None"),
        ({"distortion": {"model": "brown_conrady", "k4": 0.1}}, "no key 'k4'"),
        ({"distortion": {"model": "brown_conrady", "k1": "much"}}, "brown_conrady"),
        (
            {
                "distortion": {
                    "model": "table",
                    "angle_deg": [5, 10],
                    "radius_per_focal_length": [0.1, 0.05],
                }
            },
            "rising",
        ),
        ({"falloff": {0: 1.0}}, "rise from 0"),
        ({"falloff": {5: 1.0, 10: 0.5}}, "rise from 0"),
        ({"falloff": {0: 1.0, 10: -0.1}}, "0 to 10"),
    ],
)
def test_bad_fields_are_refused(fields, said):
    with pytest.raises(ConfigError, match=said):
        IdealLens(**fields)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"distortion": {"model": "brown_conrady", "k1": -1.2}}, "folds"),
        (
            {
                "distortion": {
                    "model": "table",
                    "angle_deg": [5, 10],
                    "radius_per_focal_length": [0.0875, 0.175],
                }
            },
            "beyond the distortion table",
        ),
        ({"falloff": {0: 1.0, 10: 0.9}}, "ends at 10 degrees"),
    ],
)
def test_a_lens_that_does_not_cover_the_field_is_refused(fields, said):
    with pytest.raises(ConfigError, match=said):
        IdealLens(**fields)(field())


def test_a_prescription_whose_rays_miss_a_surface_is_refused():
    with pytest.raises(ConfigError, match="miss a surface"):
        PrescribedLens(f_number=5.6)(field(width=64, height=64, pitch=0.04))
