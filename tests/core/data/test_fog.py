"""Fog: extinction from visibility, the phase function, and impossible values."""

import numpy as np
import pytest

from isethdr_core.data.fog import FOG_DROPLETS, Fog, PhaseLobe, fog_of, spectral_slope_of
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.early_checks import check_contents
from isethdr_core.scene import Camera, SceneDescription


def test_contrast_falls_to_a_twentieth_at_the_visibility():
    """Koschmieder's definition of visibility: a transmission of 5 %. Half of the distance transmits
    the square root.
    """
    for visibility_m in (30.0, 200.0, 4000.0):
        fog = fog_of(visibility_m)
        assert fog.transmission(visibility_m) == pytest.approx(0.05, rel=1e-12)
        assert fog.transmission(visibility_m / 2) == pytest.approx(0.05**0.5, rel=1e-12)
        assert fog.visibility_m == pytest.approx(visibility_m, rel=1e-12)


def test_fog_is_grey_and_haze_is_not():
    """The spectral slope is that of Kim, McArthur and Korevaar 2001; steps join at 1 and 6 km."""
    assert fog_of(300.0).extinction_at(450.0) == fog_of(300.0).extinction_at(650.0)
    assert [spectral_slope_of(v) for v in (500, 1000, 6000.0)] == pytest.approx([0.0, 0.5, 1.3])
    hazy = fog_of(3000.0)
    ratio = hazy.extinction_at(450.0) / hazy.extinction_at(650.0)
    assert ratio == pytest.approx((650 / 450) ** 0.82, rel=1e-12)


@pytest.mark.parametrize("lobes", [FOG_DROPLETS, (PhaseLobe(1.0, -0.5),), (PhaseLobe(1.0, 0.0),)])
def test_all_scattered_light_goes_somewhere(lobes):
    """The phase function integrates to 1 over the sphere; its mean cosine is that of the lobes."""
    fog = Fog(0.03, lobes=lobes)
    angle = np.linspace(0, np.pi, 200_001)
    weight = 2 * np.pi * fog.phase(np.cos(angle)) * np.sin(angle)
    # the sum has steps of 0.0009 degrees, which resolve the forward lobe: it is 1 degree wide
    assert np.trapezoid(weight, angle) == pytest.approx(1, abs=1e-6)
    mean = np.trapezoid(weight * np.cos(angle), angle)
    assert mean == pytest.approx(fog.mean_cosine(), abs=1e-6)


def test_droplets_scatter_back_as_a_lidar_sees_it():
    """Lidars measure a ratio of extinction to backscatter of 18 to 20 sr in water clouds (Pinnick
    et al. 1983). A single lobe of g = 0.85 would give 290 sr.
    """
    back = 1 / fog_of(100.0).phase(-1.0)
    assert 10 < back < 40
    assert 1 / PhaseLobe(1.0, 0.85).phase(-1.0) > 250


@pytest.mark.parametrize("visibility_m", [0.0, -5.0, float("nan"), float("inf")])
def test_no_fog_has_such_a_visibility(visibility_m):
    with pytest.raises(ConfigError, match="expected a number of metres above 0; type"):
        fog_of(visibility_m)


@pytest.mark.parametrize(
    "wrong",
    [
        {"extinction_per_m": 0.0},
        {"extinction_per_m": float("nan")},
        {"extinction_per_m": 0.1, "spectral_slope": float("inf")},
        {"extinction_per_m": 0.1, "albedo": 1.2},
        {"extinction_per_m": 0.1, "lobes": (PhaseLobe(0.7, 0.5),)},
        {"extinction_per_m": 0.1, "lobes": (PhaseLobe(1.0, 1.0),)},
    ],
)
def test_no_medium_has_such_numbers(wrong):
    with pytest.raises(ConfigError, match="expected"):
        Fog(**wrong)


class Knows:
    RENDERS_FOG = True


class SaysNo:
    RENDERS_FOG = False


def test_a_renderer_that_does_not_know_fog_is_refused():
    """The error is one line that says what to type. Scenes with clear air are not refused."""
    camera = Camera((0, 0, 0), (1, 0, 0))
    foggy = SceneDescription("lane", {}, (), {}, camera, fog=fog_of(80.0))
    clear = SceneDescription("lane", {}, (), {}, camera)
    check_contents(foggy, Knows())
    for other in (SaysNo(), object()):
        check_contents(clear, other)
        with pytest.raises(ConfigError) as refused:
            check_contents(foggy, other)
        text = str(refused.value)
        assert "\n" not in text
        assert type(other).__name__ in text and "scene.visibility_m=null" in text
