"""Photocurrent against irradiance that the sensor integrates over wavelength, in units of the
sensor's noise.
"""

import dataclasses

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, IdealLens, WavefrontLens
from isethdr_optics.imaging import bright_tiles, spectral_fit
from isethdr_optics.plan import planning
from isethdr_optics.psf import kernel_spectra, kernels

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.errors import UnitError
from isethdr_core.physics.convolution import convolve
from isethdr_core.physics.convolution import transform as transform
from isethdr_core.plugins.registry import build
from isethdr_core.uncertainty import ledger

BANDS = np.arange(400.0, 701.0, 20.0)
SHAPE = (48, 64)
FIELD = 0.032
LENS = DiffractionLimitedLens(focal_length_mm=6.0)
FLARES = (ApertureFlare(),)


def bump(centre, width):
    return np.exp(-0.5 * ((BANDS - centre) / width) ** 2)


def night(level=1e6, seed=0, lamps=("sodium", "led"), noise=0.005, dtype=np.float32, shape=SHAPE):
    """Return mixed radiance: four materials in daylight and lamplight, lamps of `level` times the
    road, and 0.5 % of renderer noise.
    """
    rng = np.random.default_rng(seed)
    light = {
        "sodium": 0.05 + bump(589, 6) + 0.5 * bump(568, 5),
        "led": bump(450, 9) + 0.7 * bump(560, 55),
        "day": 1.5 - BANDS / 700,
        "mercury": bump(436, 3) + bump(546, 3) + 0.6 * bump(578, 3),
    }
    materials = np.stack(
        [
            0.1 + 0 * BANDS,
            0.05 + 0.5 * bump(550, 30),
            0.05 + 0.5 * (BANDS > 600),
            0.05 + 0.4 * bump(460, 30),
        ]
    )
    kind = (
        rng.integers(0, 4, (-(-shape[0] // 8), -(-shape[1] // 8)))
        .repeat(8, 0)
        .repeat(8, 1)[: shape[0], : shape[1]]
    )
    cube = sum(
        materials[kind].transpose(2, 0, 1) * light[n][:, None, None] * rng.uniform(0.2, 2, shape)
        for n in ("day", *lamps[:1])
    )
    for i, name in enumerate(lamps):
        cube[:, 10 + 12 * i : 13 + 12 * i, 15 + 20 * i : 18 + 20 * i] += (
            level * light[name][:, None, None]
        )
        cube[:, 40, 5 + 9 * i] += 0.1 * level * light[name]
    cube = cube * (1 + noise * rng.standard_normal(cube.shape)) * 4e-6
    y, x = (quantities.centres(n, FIELD * n / SHAPE[1]) for n in shape)
    return quantities.plane(cube.astype(dtype), BANDS, x, y, quantities.RADIANCE)


def response(sensor):
    return sensor.narrow(Demand()).response


def compare(sensor, mixed, lens=LENS, flares=FLARES):
    """Return the difference of photocurrent and irradiance over the noise (capture, y, x), the mean
    electrons, and the ledger row of the photocurrent.
    """
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        short = lens.photocurrent(mixed, flares, response(sensor))
    assert short.dims == quantities.CHANNEL_DIMS and short.attrs["units"] == quantities.PHOTOCURRENT
    assert float(short.min()) >= 0
    assert "chief_rays" in short.attrs  # for sensors with microlenses
    want = sensor.expected(lens(mixed, flares)).values
    read = np.array([r.read_noise_e for r in sensor.model().readings])[:, None, None]
    return np.abs(sensor.expected(short).values - want) / np.sqrt(want + read**2), want, book[0]


@pytest.mark.parametrize("name", ["bayer", "rgbw", "split_pixel", "dual_gain"])
def test_far_below_the_noise_for_every_sensor(name):
    sensor = build("sensor", name, pitch_um=3.0)
    share, electrons, row = compare(sensor, night())
    dark = electrons < 1e5
    assert dark.any() and not dark.all()
    # the promise: a tenth of the noise below full well, a fifth above it
    assert share[dark].max() < 0.1 and share.max() < 0.2
    (note,) = [e for e in row.errors if "functionals" in e.label]
    # the ledger states the worst of a sample of tiles: the worst of all tiles may lie above it
    assert share[dark].max() < 1.5 * note.value + 1e-3


@pytest.mark.parametrize("lamps", [("mercury", "led"), ("sodium", "mercury"), ("mercury",)])
@pytest.mark.parametrize("level", [1e3, 1e8])
def test_any_lamp_is_told_well_enough(lamps, level):
    share, electrons, _ = compare(build("sensor", "bayer", pitch_um=3.0), night(level, 3, lamps))
    assert share[electrons < 1e5].max(initial=0.0) < 0.1 and share.max() < 0.2


@pytest.mark.parametrize(
    "lens",
    [
        pytest.param(
            WavefrontLens(focal_length_mm=6.0, zernike_um={7: 0.1}),
            id="aberrated",
            marks=pytest.mark.slow,
        ),
        pytest.param(DiffractionLimitedLens(focal_length_mm=6.0, falloff="none"), id="no falloff"),
        pytest.param(
            DiffractionLimitedLens(
                focal_length_mm=6.0, distortion={"model": "brown_conrady", "k1": -20.0}
            ),
            id="distorted",
        ),
    ],
)
def test_every_lens_that_can(lens):
    share, electrons, _ = compare(build("sensor", "bayer", pitch_um=3.0), night(), lens)
    assert share[electrons < 1e5].max() < 0.1


def large(monkeypatch, mirrored=True, shape=(150, 180)):
    """Replace all kernels by kernels with wings and streaks that change with wavelength.

    Return these kernels. To save time, they are divided into a near and a far part at 48 tiles.
    """
    for module in (kernel_spectra, spectral_fit):
        monkeypatch.setattr(module, "NEAR", 48)
    monkeypatch.setattr(bright_tiles, "RADII", (48, 32, 16, 8, 4))
    y, x = (np.arange(1 - n, n) for n in shape)
    bands = []
    for wave in BANDS / 550:
        r = np.hypot(y[:, None], x)
        k = (1 + r / wave) ** -3.0 * (
            1 + 0.9 * np.cos(8 * np.arctan2(y[:, None], x) + r / wave / 3)
        )
        k *= 1.0 if mirrored else 1 + 0.2 * np.tanh(x / 20)
        bands.append((0.99 * k / k.sum()).astype(np.float32))
        if mirrored:
            bands[-1] = (bands[-1] + bands[-1][::-1, ::-1]) / 2
    zero = np.zeros(len(BANDS))
    made = kernels.Kernels(bands, 1 - np.array([b.sum() for b in bands]), zero[:, None], zero + 1)
    monkeypatch.setattr(kernels, "kernels", lambda *how: made)
    assert made.divided.far is not None and made.divided.far.single and not made.divided.near.single
    return made


@pytest.mark.parametrize(
    ("mirrored", "level"),
    [
        (True, 1e8),
        (False, 1e4),
        pytest.param(True, 1e4, marks=pytest.mark.slow),
        pytest.param(False, 1e8, marks=pytest.mark.slow),
    ],
)
def test_kernels_divided_into_near_and_far(monkeypatch, mirrored, level):
    large(monkeypatch, mirrored)
    sensor = build("sensor", "bayer", pitch_um=3.0)
    share, electrons, row = compare(sensor, night(level, shape=(150, 180)))
    assert share[electrons < 1e5].max() < 0.1 and share.max() < 0.2
    assert any("far from a lamp" in e.label for e in row.errors)
    rounding = next(e for e in row.errors if "rounding of the transforms" in e.label).value
    assert 0 < rounding < 0.1  # in electrons; single precision with a lamp of 1e8


def test_near_and_far_are_the_kernel(monkeypatch):
    made = large(monkeypatch)
    bands = made.bands[:2]
    divided = kernel_spectra.divided(bands, None)
    whole = kernel_spectra.spectra(bands, None)
    image = np.random.default_rng(0).uniform(0.5, 1.5, (150, 180))
    for band, (kernel, near, far) in enumerate(
        zip(whole.kernels, divided.near.peaks, divided.far.peaks)
    ):
        seen = [
            transform.convolved(image, part.blocks[band], part.size)[0] * peak
            for part, peak in ((divided.near, near), (divided.far, far))
        ]
        # the far part has single precision; it is a few per cent of the whole
        np.testing.assert_allclose(seen[0] + seen[1], convolve(image, kernel), rtol=1e-6)
    np.testing.assert_array_equal(divided.profiles[1][0], whole.profiles[1][0])


def test_bad_functionals_are_seen_to_be_bad(monkeypatch):
    best = spectral_fit.directions
    found = []
    monkeypatch.setattr(spectral_fit, "TOLERATED", 1e9)  # accept the first number of functionals
    # no correction around lamps: it would cover the whole of so small a frame
    monkeypatch.setattr(bright_tiles, "correct", lambda *a: None)
    for order in (range(len(BANDS)), [0, 1, 2, *range(len(BANDS) - 1, 2, -1)]):
        monkeypatch.setattr(
            spectral_fit, "directions", lambda known, *m, o=list(order): best(known[:3], *m)[o]
        )
        share, _, row = compare(build("sensor", "bayer", pitch_um=3.0), night(1e8))
        (note,) = [e.value for e in row.errors if "functionals" in e.label]
        found.append((note, share.max()))
    (good_note, good), (bad_note, bad) = found
    assert bad_note > 2 * good_note and bad > 2 * good


def test_light_that_no_few_functionals_tell_goes_band_by_band(monkeypatch):
    monkeypatch.setattr(spectral_fit, "MOST", 4)
    rng = np.random.default_rng(1)
    mixed = night()
    # give every tile a different spectrum
    mixed.values[:, 20:28, 20:28] = rng.uniform(0, 1, (len(BANDS), 8, 8)) * 1e3
    sensor = build("sensor", "bayer", pitch_um=3.0)
    light = LENS.photocurrent(mixed, FLARES, response(sensor))
    assert light.dims == quantities.MIXED_DIMS
    np.testing.assert_array_equal(light.values, LENS(mixed, FLARES).values)


def test_near_functionals_leave_room_for_those_of_the_far_part(monkeypatch):
    """Functionals of the near part that use the whole allowed error would make those of the far
    part fail in any number.
    """
    large(monkeypatch)
    sensor = build("sensor", "bayer", pitch_um=3.0)
    allowed = spectral_fit.TOLERATED * response(sensor).noise_fraction_allowed

    def of_bright(self, near, far):
        of_near = 0.95 if len(near.project) < 8 else 0.5
        return allowed * (of_near + (0.1 if far else 0.0))

    monkeypatch.setattr(spectral_fit._ErrorSamples, "of_bright", of_bright)
    _, _, row = compare(sensor, night(shape=(150, 180)))
    (note,) = [e for e in row.errors if "functionals" in e.label]
    assert note.label.startswith("8 (and 3 far from a lamp)")


def test_a_frame_too_small_for_functionals_goes_band_by_band(monkeypatch):
    monkeypatch.setattr(planning, "WORTH", night().size + 1)
    assert (
        LENS.photocurrent(night(), FLARES, response(build("sensor", "bayer", pitch_um=3.0))).dims
        == quantities.MIXED_DIMS
    )


def test_no_blur_is_no_detour():
    sensor = build("sensor", "bayer", pitch_um=3.0)
    assert (
        IdealLens(focal_length_mm=6.0).photocurrent(night(), (), response(sensor)).dims
        == quantities.MIXED_DIMS
    )


def test_empty_scene_and_one_bright_tile():
    sensor = build("sensor", "bayer", pitch_um=3.0)
    mixed = night()
    mixed.values[:] = 0
    assert float(
        sensor.expected(LENS.photocurrent(mixed, FLARES, response(sensor))).max()
    ) == float(sensor.expected(LENS(mixed, FLARES)).max())
    mixed.values[:, 20, 30] = bump(550, 40) * 1e6
    share, _, _ = compare(sensor, mixed)
    assert share.max() < 0.2


def test_light_that_flares_add_is_counted(monkeypatch):
    made = kernels.kernels

    @dataclasses.dataclass(frozen=True)
    class Veil:
        def irradiance(self, lens, mixed):
            f_m = 1e-3 * lens.focal_length_mm
            return quantities.plane(
                np.full(mixed.shape, 1e-3),
                BANDS,
                mixed.x.values * f_m,
                mixed.y.values * f_m,
                quantities.IRRADIANCE,
            )

    # use the kernels of other tests, to save time
    monkeypatch.setattr(
        kernels, "kernels", lambda request: made(dataclasses.replace(request, flares=FLARES))
    )
    share, electrons, _ = compare(build("sensor", "bayer", pitch_um=3.0), night(), flares=(Veil(),))
    assert share[electrons < 1e5].max() < 0.1


def test_photocurrent_of_another_sensor_is_refused():
    first, second = (
        build("sensor", "bayer", pitch_um=3.0, peak_qe=qe, dark_e_per_s=0.0) for qe in (0.65, 0.3)
    )
    light = LENS.photocurrent(night(), FLARES, response(first))
    with pytest.raises(UnitError, match="another sensor"):
        second.expected(light)
    both = LENS.photocurrent(night(), FLARES, response(first) + response(second))
    # rounding to float32
    np.testing.assert_allclose(
        first.expected(both).values / second.expected(both).values, 0.65 / 0.3, rtol=1e-6
    )


def test_same_light_whatever_the_number_of_threads(monkeypatch):
    sensor = build("sensor", "bayer", pitch_um=3.0)
    seen = []
    for cpus in (1, 3):
        monkeypatch.setenv("OMP_NUM_THREADS", str(cpus))
        seen.append(LENS.photocurrent(night(), FLARES, response(sensor)).values)
    np.testing.assert_array_equal(*seen)


def test_a_field_of_few_tiles_is_imaged_band_by_band():
    """All tiles count as bright, so that none is left for the fit of the spectrum."""
    mixed = night().isel(y=slice(0, 6), x=slice(0, 8))
    sensor = build("sensor", "bayer", pitch_um=3.0)
    lens = IdealLens(focal_length_mm=6.0)
    blurred = planning.complete_plan(LENS, (), mixed, response(sensor)).image(mixed)
    assert blurred.attrs["units"] == quantities.IRRADIANCE
    assert float(blurred.sum()) < float(lens(mixed).sum())
