"""Flares: energy and spikes of the aperture, third-party pupils, scatter, added light."""

from dataclasses import dataclass

import numpy as np
import pytest
from isethdr_optics import (
    ApertureFlare,
    DiffractionLimitedLens,
    IdealFlare,
    IdealLens,
    WavefrontLens,
)
from isethdr_optics.pupil.pupil_cells import amplitude
from isethdr_optics.pupil.pupil_energy import open_energy_mm2

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError, PluginError

LENS = DiffractionLimitedLens(falloff="none")


def scene(n=15, pitch_um=4.0, lamp=1e6):
    x = quantities.centres(n, n * pitch_um * 1e-3 / 4.0)
    values = np.ones((1, n, n))
    values[0, n // 2, n // 2] = lamp
    return quantities.plane(values, [550.0], x, x, quantities.RADIANCE)


@dataclass(frozen=True)
class HalfTone:
    """A third-party flare with nothing but `pupil`: a neutral grey of amplitude 0.8."""

    def pupil(self, x_mm, y_mm, wavelength_nm):
        return 0.8 + 0.0 * (x_mm + y_mm)


@dataclass(frozen=True)
class Wedge:
    """A third-party complex pupil: a wedge that moves the image by `shift_um` along +x."""

    shift_um: float = 8.0

    def pupil(self, x_mm, y_mm, wavelength_nm):
        return np.exp(2j * np.pi * self.shift_um * x_mm / 4.0 / (wavelength_nm * 1e-3)) + 0.0 * y_mm


@dataclass(frozen=True)
class Haze:
    """Scatter of an exponential in angle, strong enough to see."""

    share: float = 0.05

    def scatter(self, wavelength_nm, angle_rad):
        s = 0.01
        return self.share * np.exp(-angle_rad / s) / (2 * np.pi * s * s)


@dataclass(frozen=True)
class Ghost:
    """Adds the same light everywhere."""

    def irradiance(self, lens, mixed):
        f = 1e-3 * lens.focal_length_mm
        return quantities.plane(
            np.full(mixed.shape, 7.0),
            mixed.wavelength,
            mixed.x * f,
            mixed.y * f,
            quantities.IRRADIANCE,
        )


def test_ideal_flare_changes_nothing():
    for lens in (LENS, IdealLens()):
        np.testing.assert_array_equal(lens(scene(), [IdealFlare()]), lens(scene()))


def test_round_clean_aperture_is_the_bare_lens():
    flare = ApertureFlare(blades=0, dust_per_mm2=0.0, scratches_per_mm2=0.0)
    # 2e-5: the energy of the kernel is extrapolated
    np.testing.assert_allclose(
        LENS.psf([550], 1.0, 64, [flare]), LENS.psf([550], 1.0, 64), rtol=2e-5
    )


def test_hexagon_takes_light_and_makes_six_spikes():
    flare = ApertureFlare(dust_per_mm2=0.0, scratches_per_mm2=0.0, rotation_deg=0.0)
    hexagon = 6 / 2 * 0.25 * np.sin(np.pi / 3)
    assert open_energy_mm2(LENS, [flare], 550.0) == pytest.approx(hexagon, rel=1e-5)
    assert float(LENS(scene(), [flare]).attrs["throughput_sr"]) == pytest.approx(
        LENS.throughput_sr() * hexagon / (np.pi / 4), rel=1e-5
    )
    parity = DiffractionLimitedLens(falloff="none", aperture_loss=False)
    assert parity(scene(), [flare]).attrs["throughput_sr"] == LENS.throughput_sr()
    psf = LENS.psf([550], 1.0, 301, [flare]).values[0]
    y, x = np.indices(psf.shape) - 150
    ring = (np.hypot(x, y) > 60) & (np.hypot(x, y) < 140)
    light = np.histogram(
        np.degrees(np.arctan2(y, x))[ring] % 60, bins=12, range=(0, 60), weights=psf[ring]
    )[0]
    # Blades face 30 degrees from the corners; spikes stand perpendicular to blades: at 30 degrees
    # modulo 60.
    assert light[5:7].sum() > 5 * light[[0, 1, -1, -2]].sum()
    np.testing.assert_allclose(psf, psf[::-1, ::-1], rtol=1e-6, atol=1e-12)  # a pupil without phase


def test_spikes_scale_with_wavelength():
    flare = ApertureFlare(dust_per_mm2=0, scratches_per_mm2=0)
    a = LENS.psf([450], 0.9, 128, [flare]).values[0]
    b = LENS.psf([600], 1.2, 128, [flare]).values[0]
    np.testing.assert_allclose(a, b, atol=1e-6 * a.max())  # the same grid in units of wavelength


def test_dust_and_seed():
    a, b, c = (LENS.psf([550], 1.0, 128, [ApertureFlare(seed=s)]).values for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 1e-5
    clean = LENS.psf([550], 1.0, 128, [ApertureFlare(dust_per_mm2=0, scratches_per_mm2=0)]).values
    assert a.sum() < clean.sum()  # dirt scatters light beyond the samples
    assert a.min() >= 0


@pytest.mark.slow
def test_order_of_flares_does_not_matter_and_dictionaries_do():
    one = ApertureFlare(dust_per_mm2=0)
    two = HalfTone()
    np.testing.assert_allclose(
        LENS.psf([550], 1.0, 64, [one, two]),
        LENS.psf([550], 1.0, 64, {"b": two, "a": one}),
        rtol=1e-5,
    )


@pytest.mark.slow
def test_third_party_pupils():
    grey = LENS(scene(), [HalfTone()])
    assert grey.attrs["throughput_sr"] == pytest.approx(0.64 * LENS.throughput_sr(), rel=1e-4)
    # the cells of a pupil differ from the closed form of the clean stop by 2e-3
    np.testing.assert_allclose(grey, 0.64 * LENS(scene()), rtol=3e-3)
    psf = LENS.psf([550], 1.0, 65, [Wedge()]).values[0]
    assert np.unravel_index(psf.argmax(), psf.shape) == (32, 40)  # complex pupil: not symmetric
    tilted = WavefrontLens(zernike_um={2: 0.5}).psf([550], 1.0, 65).values[0]
    # shift of the tilt: 4 N c = 8 um; the tolerance is for the phase averaged over a cell
    np.testing.assert_allclose(psf, tilted, atol=2e-4 * psf.max())


@pytest.mark.slow
def test_lens_image_of_a_complex_pupil_moves_the_right_way():
    light = LENS(scene(), [Wedge()]).values[0]
    assert np.unravel_index(light.argmax(), light.shape) == (7, 9)  # 8 um = 2 tiles to +x


def test_scatter_conserves_energy():
    clean, hazy = (LENS.psf([550], 2.0, 401, f) for f in ((), [Haze()]))
    assert float(hazy.values[0, 200, 200]) == pytest.approx(
        0.95 * float(clean.values[0, 200, 200]), rel=1e-3
    )
    # nearly all of the haze lies within 400 um = 0.1 rad, which is ten times its decay angle
    assert float(hazy.sum()) == pytest.approx(0.95 * float(clean.sum()) + 0.05, abs=5e-5)
    light = IdealLens(falloff="none")(scene(101, 4.0, 1e6), [Haze()])
    direct = IdealLens(falloff="none")(scene(101, 4.0, 1e6))
    assert float(light[0, 50, 50]) == pytest.approx(0.95 * float(direct[0, 50, 50]), rel=1e-2)
    assert float(light[0, 50, 60]) > 3 * float(direct[0, 50, 60])


def test_added_light():
    np.testing.assert_allclose(LENS(scene(), [Ghost()]) - LENS(scene()), 7.0, rtol=1e-9)


def test_what_breaks_the_contract_is_refused():
    class Bright:
        def pupil(self, x_mm, y_mm, wavelength_nm):
            return 1.5 + 0 * (x_mm + y_mm)

    class Wrong:
        def irradiance(self, lens, mixed):
            return mixed

    with pytest.raises(ConfigError, match="above 1"):
        LENS.psf([550], 1.0, 32, [Bright()])
    with pytest.raises(ConfigError, match="quarter wave"):
        LENS.psf([550], 1.0, 32, [Wedge(shift_um=600.0)])
    with pytest.raises(PluginError, match="units"):
        LENS(scene(), [Wrong()])
    with pytest.raises(ConfigError, match="less than 1"):
        LENS.psf([550], 1.0, 32, [Haze(share=1.2)])


def test_points_and_shapes_of_the_aperture_agree():
    flare = ApertureFlare()
    x = (np.arange(1200) + 0.5) / 1200 - 0.5
    points = flare.pupil(x[None, :], x[:, None], 550.0).reshape(60, 20, 60, 20).mean((1, 3))
    coarse = x.reshape(60, 20).mean(1)
    cells = amplitude(LENS, [flare], coarse, coarse, 550.0)
    assert np.abs(points - cells).mean() < 5e-3  # points resolve a twentieth of a cell
