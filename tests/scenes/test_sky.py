"""The sky at a given hour: light levels against published ones, smoothness, and the sky dome as a
table.
"""

import sys

import numpy as np
import pytest
from isethdr_scenes.night_drive import NightDrive
from isethdr_scenes.sky import dome as domes
from isethdr_scenes.sky import illuminance, night_light
from isethdr_scenes.sky.spectra import NM, luminance_of, sky_spectrum
from isethdr_scenes.sky.state import PRESETS, SkyState, sky_state

from isethdr_core.data.sky import cosine_integral, pattern_at, sky_direction, sky_elevations_deg
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import xyz

COUNTRY = SkyState()


def lux(**state):
    return domes.horizontal_lx(SkyState(**state))


@pytest.mark.parametrize(
    "state,low,high",
    [
        ({"sun_elevation_deg": 60.0}, 8e4, 1.1e5),
        ({"sun_elevation_deg": -0.83}, 300, 600),
        ({"sun_elevation_deg": -6.0}, 2.5, 4.5),
        ({"sun_elevation_deg": -12.0}, 5e-3, 1.2e-2),
        ({"moon_elevation_deg": 60.0}, 0.15, 0.3),
        ({}, 5e-4, 2e-3),
    ],
)
def test_level_ground_gets_the_light_of_the_hour(state, low, high):
    assert low < lux(**state) < high


def test_a_citys_zenith_is_as_bright_as_published():
    sky = domes.dome_of(PRESETS["night_city"])
    nm = np.array(sky.wavelength_nm)
    zenith = xyz(sky.radiance(sky_direction(90, 0), nm), nm, axis=-1)[1]
    assert 5e-3 < zenith < 5e-2
    # 1 %: the patterns are fitted
    assert zenith == pytest.approx(night_light.zenith_cd_m2(9), rel=0.01)


def night_lx():
    up = np.arange(0.5, 90)
    weight = 2 * np.pi * np.sin(np.radians(up)) * np.cos(np.radians(up)) * np.radians(1)
    level = night_light.natural_cd_m2(up) + night_light.artificial_cd_m2(up, COUNTRY.bortle)
    return float(level @ weight)


def test_twilight_falls_steadily():
    altitude = np.arange(50, -181, -1) / 10
    level = illuminance.sun_illuminance_lx(altitude) + night_lx()
    share = level[1:] / level[:-1]
    assert share.max() < 1
    assert share.min() > 1 - 0.12


@pytest.mark.parametrize("altitude", [5.0, 0.2, -0.3, -0.83, -3.0, -7.5, -15.0])
def test_the_dome_has_the_light_of_the_formula(altitude):
    # 0.3 %: only the light of the night sky is integrated, in steps of a degree here
    expected = illuminance.sun_illuminance_lx(altitude) + night_lx()
    assert lux(sun_elevation_deg=altitude) == pytest.approx(expected, rel=0.003)


@pytest.mark.parametrize(
    "joint",
    [
        *(pytest.param(deg, marks=pytest.mark.slow) for deg in (20.0, 0.5, -5.0)),
        *(5.0, -0.268 - 0.57, -18.0),
    ],
)
def test_nothing_jumps_where_models_meet(joint):
    # 1.6 %: a step of 0.01 degrees changes the light by at most 1.2 %, and the pieces of the
    # published fit agree to 0.4 % where they meet
    above, below = (lux(sun_elevation_deg=joint + d) for d in (0.005, -0.005))
    assert above / below == pytest.approx(1, abs=0.016)


def test_a_full_moon_is_as_bright_as_the_formula_whatever_its_altitude():
    for altitude in (60.0, 20.0, 1.0, -0.5):
        expected = illuminance.moon_illuminance_lx(altitude) + night_lx()
        assert lux(moon_elevation_deg=altitude) == pytest.approx(float(expected), rel=0.003)
    half = domes.dome_of(SkyState(moon_elevation_deg=40.0, moon_phase_deg=90.0)).discs[0]
    full = domes.dome_of(SkyState(moon_elevation_deg=40.0)).discs[0]
    # the full moon has 2,000 to 6,000 cd/m2, and the half moon an eighth of its light
    assert 2e3 < luminance_of(full.radiance.at(NM)) < 6e3
    assert luminance_of(half.radiance.at(NM)) < 0.15 * luminance_of(full.radiance.at(NM))


def test_the_sky_of_a_day_is_mitsubas_with_its_sun():
    sky = domes.dome_of(PRESETS["noon"])
    nm = np.arange(400.0, 701.0, 10)
    ahead, behind = sky.radiance(sky_direction(20, [110, 290]), nm)
    assert (ahead > behind).all()  # brighter towards the sun
    zenith = xyz(sky.radiance(sky_direction(90, 0), nm), nm, axis=-1)
    assert zenith[2] > 1.3 * zenith[1]  # blue
    (sun,) = sky.discs
    direct = sun.radiance.at(NM) * sun.solid_angle_sr() * np.sin(np.radians(60))
    # the sun gives 70 to 90 % of the light of a clear noon
    assert 0.7 < luminance_of(direct) / lux(sun_elevation_deg=60.0) < 0.9
    assert sky.wavelength_nm[-1] == 720  # Mitsuba's data


def test_turning_the_sun_turns_the_sky():
    # 65 degrees are 13 whole steps of the grid, so there is no interpolation
    still, turned = (
        domes.dome_of(SkyState(sun_elevation_deg=-4.0, sun_azimuth_deg=a)) for a in (0.0, 65.0)
    )
    for a, b in zip(still.parts, turned.parts):
        assert np.allclose(np.roll(a.pattern, 13, 1), b.pattern, rtol=1e-9)


def test_a_pattern_is_looked_up_at_its_nodes_and_between():
    up = sky_elevations_deg(65)
    pattern = 2 + np.sin(np.radians(up))[:, None] * np.ones(72)
    assert pattern_at(pattern, sky_direction(up[40], 35)) == pytest.approx(pattern[40, 0])
    # 1e-3: linear interpolation of a sine between nodes
    assert pattern_at(pattern, sky_direction(33.3, 2.2)) == pytest.approx(
        2 + np.sin(np.radians(33.3)), rel=1e-3
    )
    # a sky of 1 everywhere lights level ground with pi
    assert cosine_integral(np.ones((65, 72))) == pytest.approx(np.pi, rel=1e-4)


@pytest.mark.parametrize(
    "light", ["twilight", "glow", "moonlight", "moonlit_air", "natural", "city"]
)
def test_spectra_are_of_one_candela_per_square_metre(light):
    assert luminance_of(sky_spectrum(light)) == pytest.approx(1)
    assert sky_spectrum(light).min() >= 0


def test_blue_twilight_has_a_warm_horizon_under_the_sun():
    sky = domes.dome_of(PRESETS["dusk"])
    nm = np.array(sky.wavelength_nm)
    glow, zenith = (
        xyz(sky.radiance(sky_direction(*d), nm), nm, axis=-1) for d in ((2, 20), (90, 0))
    )
    assert glow[1] > 5 * zenith[1]
    assert glow[0] / glow[2] > 2 * zenith[0] / zenith[2]


def test_a_place_and_a_time():
    pytest.importorskip("ephem")
    where = {"latitude_deg": 48.1372, "longitude_deg": 11.5755, "heading_deg": 90.0}
    state = sky_state("noon", {**where, "time_utc": "2026-06-21T11:15"})
    # Solar noon in Munich in summer: an elevation of 90 - 48.14 + 23.44 degrees, in the south,
    # which is to the right of a road that leads east. 0.1 degrees: the equation of time is within a
    # quarter of a minute.
    assert state.sun_elevation_deg == pytest.approx(65.30, abs=0.1)
    assert state.sun_azimuth_deg == pytest.approx(90, abs=2)
    # 2026-08-28 04:18 UTC: full moon, with an eclipse
    full = sky_state("noon", {**where, "time_utc": "2026-08-28T04:18+00:00"})
    assert full.moon_phase_deg < 1.5


def test_a_place_without_the_library_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ephem", None)
    hour = {"latitude_deg": 48, "longitude_deg": 11, "time_utc": "2026-06-21T11:15"}
    with pytest.raises(ConfigError, match=r"isethdr\[sky\]"):
        sky_state("noon", hour)


@pytest.mark.parametrize(
    "sky,hour,message",
    [
        ("uniform", {"bortle": 3}, "scene.sky is uniform.*type for example scene.sky=noon"),
        ("noon", {"sun_elevation": 3}, "no key 'sun_elevation'; did you mean 'sun_elevation_deg'"),
        ("noon", {"sun_elevation_deg": 91}, "sun_elevation_deg.*-90 to 90"),
        ("noon", {"bortle": 0}, "bortle.*1 to 9"),
        ("noon", {"latitude_deg": 3.0}, "no longitude_deg"),
        (
            "noon",
            {"latitude_deg": 3, "longitude_deg": 3, "time_utc": "2026-01-01", "moon_phase_deg": 3},
            "moon_phase_deg beside a place",
        ),
        (
            "noon",
            {"latitude_deg": 3, "longitude_deg": 3, "time_utc": "tomorrow"},
            "'tomorrow'; expected a date",
        ),
    ],
)
def test_an_hour_that_cannot_be_is_refused_when_the_scene_is_composed(sky, hour, message):
    pytest.importorskip("ephem")
    with pytest.raises(ConfigError, match=message):
        NightDrive(sky=sky, hour=hour)
