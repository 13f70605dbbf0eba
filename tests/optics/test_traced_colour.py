"""Colour of a traced lens: focus of every wavelength on and off the axis, and positions of its
images, against independent rays.
"""

import numpy as np
import pytest
from isethdr_optics import PrescribedLens, WavefrontLens
from isethdr_optics.field.lateral_colour import Course, displaced, magnified
from isethdr_optics.imaging.sensor_plane import sensor_plane
from isethdr_optics.lenses.field_point_lens import node_lens
from isethdr_optics.prescription.wavefront import zernike_um
from isethdr_optics.pupil import wavefronts

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.paraxial import back_focus_mm
from isethdr_core.uncertainty import ledger

SINGLET = dict(prescription="singlet", f_number=16.0, focal_length_mm=20.0)


def test_the_traced_focus_of_a_wavelength_is_that_of_the_matrices():
    """Compare the traced defocus with paraxial matrices.

    A focus dz beyond the sensor is a defocus of dz / (16 sqrt(3) N^2), um rms.
    """
    lens = PrescribedLens(**SINGLET)
    real = lens.real()
    for wave in (440.0, 467.0, 560.0, 655.0):
        focus = 1e3 * (
            back_focus_mm(real.surfaces[:-1], real.indices(wave))
            - back_focus_mm(real.surfaces[:-1], real.indices(real.reference_nm))
        )
        # f-number at this wavelength, which has its own focal length
        f_number = 16.0 / lens.pupil_scale_at(0.0, wave)
        shift = lens.colour_at(0.0, wave)[4] * 16 * 3**0.5 * f_number**2
        # the parabola for a shift has a relative error of shift / focal length, here up to 2.6 %;
        # blue light focuses in front of the sensor
        assert shift == pytest.approx(focus, rel=0.01 + abs(focus) / 20e3, abs=0.5) and (
            shift < 0
        ) == (wave < real.reference_nm)
    given = PrescribedLens(focal_shift_um={400.0: 0.0, 700.0: 1.0}, **SINGLET)
    assert given.colour_at(0.0, 450.0) == {}
    assert PrescribedLens(wavefront="none").psf(450.0, 2.0, 32).sum() == pytest.approx(
        float(WavefrontLens().psf(450.0, 2.0, 32).sum())
    )


@pytest.mark.slow
def test_every_wavelength_has_its_own_wavefront_off_the_axis_too():
    lens = PrescribedLens(f_number=4.0)
    angle = np.radians(11.0)
    place = node_lens(lens, lens.wavefront_at(angle), 0.0, angle)
    for wave in (430.0, 500.0, 650.0):
        own = wavefronts.coefficients_um(place, wave)
        exact = zernike_um(lens.real(), float(np.tan(angle)), wave)[0]
        off = sum((own.get(j, 0.0) - exact.get(j, 0.0)) ** 2 for j in {*own, *exact}) ** 0.5
        assert off < 1e-3  # um rms between traced wavelengths; 1/500 of a wave
    reference = wavefronts.coefficients_um(place, 587.56)
    lost = [wavefronts.coefficients_um(place, w)[4] - reference[4] for w in (430.0, 650.0)]
    axis = node_lens(lens, lens.wavefront_at(0.0), 0.0, 0.0)
    kept = [
        wavefronts.coefficients_um(axis, w)[4] - wavefronts.coefficients_um(axis, 587.56)[4]
        for w in (430.0, 650.0)
    ]
    # the focus changes with wavelength, and not in the same way as on the axis
    assert min(map(abs, lost)) > 5e-3 and max(abs(a - b) for a, b in zip(lost, kept)) > 1e-3


def test_colour_turns_with_the_place():
    lens = PrescribedLens(prescription="singlet", f_number=8.0)
    angle = np.radians(12.0)
    right, up = (
        node_lens(lens, lens.wavefront_at(angle), turn, angle).psf(450.0, 1.0, 65).values[0]
        for turn in (0.0, np.pi / 2)
    )
    # the cells of the pupil are symmetric under a quarter turn
    np.testing.assert_allclose(np.rot90(right), up, atol=1e-5 * up.max())


def scene(tangent, pitch, bands, rows=8, more=24):
    """Return mixed radiance with a lamp of 2 tiles at `tangent` along +x, symmetric about y = 0.

    The field ends `more` tiles beyond the lamp.
    """
    half = int(np.ceil(tangent / pitch)) + more
    values = np.zeros((len(bands), rows, 2 * half))
    values[:, rows // 2 - 1 : rows // 2 + 1, half + int(round(tangent / pitch - 0.5))] = 1.0
    x = quantities.centres(2 * half, 2 * half * pitch)
    y = quantities.centres(rows, rows * pitch)
    return quantities.plane(values, list(bands), x, y, quantities.RADIANCE)


def own_ray_um(real, tangent, wavelength_nm):
    """Return the height of the chief ray on the sensor, um, by independent formulas.

    Rays meet spheres by their centres and are refracted by angles. Bisection finds the ray through
    the middle of the stop.
    """

    def through(y, target):
        z = real.surfaces[0].z_mm
        slope = np.arctan(tangent)
        for k, s in enumerate(real.surfaces):
            if s.curvature_per_mm == 0:
                y = y + (s.z_mm - z) * np.tan(slope)
                z = s.z_mm
                normal = 0.0
            else:
                radius = 1 / s.curvature_per_mm
                centre = s.z_mm + 1 / s.curvature_per_mm
                # distance of the centre from the ray, over the radius; then the direction of the
                # normal where the ray meets the sphere
                height = (y * np.cos(slope) - (z - centre) * np.sin(slope)) / radius
                normal = slope - np.arcsin(height)
                y = -radius * np.sin(normal)
                z = centre - radius * np.cos(normal)
            if k == target:
                return y
            n1, n2 = real.indices(wavelength_nm)[k : k + 2]
            slope = normal + np.arcsin(n1 / n2 * np.sin(slope - normal))
        raise AssertionError(target)

    low = -0.6 * real.focal_length_mm()
    high = 0.6 * real.focal_length_mm()
    starts = np.linspace(low, high, 241)
    with np.errstate(invalid="ignore"):
        hits = np.array([through(y, real.stop) for y in starts])
    good = np.isfinite(hits)
    starts = starts[good]
    hits = hits[good]
    cross = np.flatnonzero(np.sign(hits[:-1]) != np.sign(hits[1:]))[0]
    a, b = starts[cross : cross + 2]
    for _ in range(60):
        middle = (a + b) / 2
        a, b = (
            (middle, b)
            if np.sign(through(middle, real.stop)) == np.sign(through(a, real.stop))
            else (a, middle)
        )
    return 1e3 * through((a + b) / 2, len(real.surfaces) - 1)


def centroids_um(plane, values):
    return [1e6 * 4e-3 * float(v.sum(axis=0) @ plane.x / v.sum()) for v in plane.move(values)]


@pytest.mark.parametrize(
    ("name", "f_number"),
    [
        pytest.param("double_gauss", 4.0, marks=pytest.mark.slow),
        ("cooke_triplet", 5.6),
        pytest.param("singlet", 8.0, marks=pytest.mark.slow),
    ],
)
def test_blue_and_red_images_at_70_percent_of_the_field_lie_where_their_rays_do(name, f_number):
    bands = (450.0, 587.56, 650.0)
    lens = PrescribedLens(prescription=name, f_number=f_number, wavefront="none", falloff="none")
    real = lens.real()
    light = scene(0.7 * np.tan(np.radians(real.half_field_deg)), 0.0004, bands, rows=16)
    plane = sensor_plane(lens, light)
    tangent = float(light.x[np.flatnonzero(light.values[0].any(axis=0))[0]])
    found = centroids_um(plane, light.values)
    want = [own_ray_um(real, tangent, w) for w in bands]
    assert abs(want[0] - want[2]) > (0.005 if name == "cooke_triplet" else 0.2)
    # a tile of 1.6 um that is stretched by up to 2 % and shared by area has its centroid off by 1 %
    # of its width
    np.testing.assert_allclose(found, want, atol=0.02)
    # the stretch is almost the same in all bands, so differences are more exact
    np.testing.assert_allclose(np.diff(found), np.diff(want), atol=2e-3)
    kept = plane.move(light.values).sum(axis=(1, 2))
    np.testing.assert_allclose(kept, light.values.sum(axis=(1, 2)), rtol=1e-9)


@pytest.mark.slow
def test_the_whole_lens_moves_its_bands():
    same = dict(f_number=4.0, wavefront="none", falloff="none", distortion="none")
    light = scene(0.15, 0.012, (450.0, 650.0), rows=2, more=3)
    image, plain = (PrescribedLens(lateral_colour=c, **same)(light) for c in ("traced", "none"))
    at, before = (
        [1e6 * float(v.sum(axis=0) @ i.x.values / v.sum()) for v in i.values.astype(float)]
        for i in (image, plain)
    )
    tangent = float(light.x[np.flatnonzero(light.values[0].any(axis=0))[0]])
    real = PrescribedLens(**same).real()
    blue, reference, red = (own_ray_um(real, tangent, w) for w in (450.0, real.reference_nm, 650.0))
    want = (blue - red) / reference * 4e3 * tangent
    assert (at[0] - before[0]) - (at[1] - before[1]) == pytest.approx(want, rel=0.05) and want > 0.1
    assert image.values.min() >= 0
    # 1e-3: light in the PSF wings that leaves the frame
    np.testing.assert_allclose(
        image.values.sum(axis=(1, 2)), plain.values.sum(axis=(1, 2)), rtol=1e-3
    )


def test_a_course_without_course_is_a_magnification_and_light_is_kept():
    values = np.random.default_rng(4).random((31, 45))
    for scale in (0.97, 0.999, 1.0, 1.0007, 1.03):
        course = Course(np.array([0.0, 9.0]), np.array([scale, scale]), (0.1, 0.1))
        np.testing.assert_allclose(
            displaced(values, course, (29, 43)),
            magnified(values, scale, (29, 43)),
            rtol=1e-9,
            atol=1e-12,
        )
    inner = np.zeros((31, 45))
    inner[5:26, 6:39] = 10 ** np.random.default_rng(5).uniform(-12, 0, (21, 33))
    bent = Course(np.linspace(0, 3, 50), 1 + 0.002 * np.linspace(0, 1, 50) ** 2, (0.1, 0.1))
    out = displaced(inner, bent, (31, 45))
    assert out.sum() == pytest.approx(inner.sum(), rel=1e-12) and out.min() >= 0


def test_uniform_light_thins_by_the_area_ratio_of_a_bent_course():
    """Compare with the closed form: r -> r (1 + k r^2) magnifies the area by
    (1 + k r^2) (1 + 3 k r^2).
    """
    k = 0.004
    radius = np.linspace(0, 3, 2000)
    out = displaced(np.ones((31, 45)), Course(radius, 1 + k * radius**2, (0.1, 0.1)), (29, 43))
    x = (np.arange(43) - 21) * 0.1
    y = (np.arange(29) - 14) * 0.1
    from_r = np.hypot(*np.meshgrid(x, y))
    source = from_r
    for _ in range(20):
        source = from_r / (1 + k * source**2)
    want = 1 / ((1 + k * source**2) * (1 + 3 * k * source**2))
    np.testing.assert_allclose(
        out,
        want,
        rtol=2e-4,
        # the light of a tile is uniform, while the exact density changes by 0.8 % per tile
    )


def test_dark_tiles_beside_a_lamp_keep_their_digits():
    values = np.full((9, 31), 1e-12)
    values[4, 15] = 1.0
    course = Course(np.array([0.0, 9.0]), np.array([1.0, 1.0004]), (0.1, 0.1))
    out = displaced(values, course, (9, 31))
    # 2e-3: the magnification dilutes the light; a lamp of 1e12 leaves no rounding
    np.testing.assert_allclose(out[:, :12], 1e-12, rtol=2e-3)


@pytest.mark.slow
def test_the_ledger_and_bad_use():
    lens = PrescribedLens(wavefront="none", distortion="none")
    plane = sensor_plane(lens, scene(0.05, 0.002, (450.0, 550.0, 650.0), 4))
    left_out = [note.what for note in plane.notes if isinstance(note, ledger.LeftOut)]
    errors = [note.source.key for note in plane.notes if isinstance(note, ledger.ErrorTerm)]
    assert "change of magnification within a band" in left_out
    assert "magnified light" in errors
    with pytest.raises(ConfigError, match="miss a surface"):
        sensor_plane(lens, scene(3.0, 0.1, (450.0,), 4))
    with pytest.raises(ConfigError, match="undefined"):
        PrescribedLens(f_number=4.0).psf(200.0, 1.0, 16)
