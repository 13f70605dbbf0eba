"""Windscreen: share and separation of the second image against closed forms and traced rays."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, IdealLens
from isethdr_optics.flare.windscreen import WindscreenFlare, shifted

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError

N = 1.52


def refracted(way, normal, ratio):
    """Refract a unit vector by Snell's law in vector form; `normal` points against it."""
    cosine = -way @ normal
    return ratio * way + (ratio * cosine - np.sqrt(1 - ratio**2 * (1 - cosine**2))) * normal


def mirrored(way, normal):
    return way - 2 * (way @ normal) * normal


def circle_hit(point, way, centre, radius, far):
    """Return the point ahead where a ray meets a circle: the further or the nearer one."""
    rel = point - centre
    b = rel @ way
    root = np.sqrt(b**2 - rel @ rel + radius**2)
    ways = [k for k in (-b - root, -b + root) if k > 1e-9]
    return point + way * (max(ways) if far else min(ways))


def left(  # noqa: PLR0913 - a helper of tests
    point, way, incidence, thickness, radius, wedge, bounces
):
    """Trace a ray from outside through a pane and return its direction behind the pane.

    The surfaces are two circles about one centre behind the pane, or two planes with an angle
    between them.
    """
    outer = np.array([-1.0, 0.0])  # normal of the front surface at the origin
    turn = np.array([[np.cos(wedge), -np.sin(wedge)], [np.sin(wedge), np.cos(wedge)]])
    centre = np.array([radius, 0.0])

    def normal(at, rear):
        if np.isfinite(radius):
            return (at - centre) / np.linalg.norm(at - centre)
        return turn @ outer if rear else outer

    def meet(at, way, rear):
        if np.isfinite(radius):
            size = radius - thickness if rear else radius
            return circle_hit(at, way, centre, size, far=not rear)
        plane = normal(at, rear)
        place = np.array([thickness, 0.0]) if rear else np.zeros(2)
        return at + way * (((place - at) @ plane) / (way @ plane))

    way = refracted(way, normal(point, False), 1 / N)
    at = meet(point, way, True)
    for _ in range(bounces):
        way = mirrored(way, normal(at, True))
        at = meet(at, way, False)
        way = mirrored(way, normal(at, False))
        at = meet(at, way, True)
    return refracted(way, normal(at, True), N)


@pytest.mark.parametrize("incidence", [20.0, 60.0, 70.0])
@pytest.mark.parametrize("radius_m, wedge_mrad", [(5.0, 0.0), (np.inf, 0.3), (np.inf, -0.2)])
def test_the_separation_is_that_of_traced_rays(incidence, radius_m, wedge_mrad):
    """Compare the separation of both images with independently traced rays.

    1 %: the formulas are of first order in thickness over radius, and in the wedge.
    """
    angle = np.radians(incidence)
    way = np.array([np.cos(angle), np.sin(angle)])
    pane = (incidence, 4.8e-3, radius_m, 1e-3 * wedge_mrad)
    first, second = (left(np.zeros(2), way, *pane, bounces) for bounces in (0, 1))
    traced = np.arctan2(*second[::-1]) - np.arctan2(*first[::-1])
    flare = WindscreenFlare(incidence, 4.8, radius_m, wedge_mrad, N)
    found = float(flare.separation_rad(np.cos(angle)))
    assert abs(found) > 1e-4
    assert abs(found) == pytest.approx(abs(traced), rel=0.01)


def test_the_share_follows_fresnel():
    flare = WindscreenFlare(inner_transmittance=0.9, index=N)
    normal = ((N - 1) / (N + 1)) ** 2
    assert flare.share(np.array(1.0)) == pytest.approx((0.9 * normal) ** 2, rel=1e-12)
    # at Brewster's angle one polarisation has no second image
    brewster = np.arctan(N)
    # Fresnel's equation for s polarisation: sin^2(i - r) / sin^2(i + r), where i + r is a right
    # angle
    reflected = np.sin(brewster - np.arcsin(np.sin(brewster) / N)) ** 2
    want = 0.81 * ((1 - reflected) * reflected) ** 2 / ((1 - reflected) ** 2 + 1)
    assert flare.share(np.cos(brewster)) == pytest.approx(want, rel=1e-9)
    assert WindscreenFlare(index=1.0).share(np.array(0.5)) == 0.0


def field(ny=41, nx=5, pitch=2e-4):
    mixed = quantities.plane(
        np.zeros((2, ny, nx)),
        [500.0, 600.0],
        quantities.centres(nx, nx * pitch),
        quantities.centres(ny, ny * pitch),
        quantities.RADIANCE,
    )
    mixed.values[0, 20, 2] = 1e6
    return mixed


def test_a_lamp_gets_a_second_image_above_it():
    flare = WindscreenFlare()
    lens = IdealLens(focal_length_mm=4.0, f_number=2.0)
    mixed = field()
    added = flare.irradiance(lens, mixed)
    assert not added.values[1].any() and (added.values >= 0).all()
    column = added.values[0, :, 2]
    share = float(flare.share(flare.cosine(np.array(0.0), np.array(0.0))))
    light = 1e6 * share * lens.throughput_sr()
    # 1 %: the share falls by 0.6 % over the milliradian between both images
    assert column.sum() == pytest.approx(light, rel=0.01)
    apart = -float(column @ mixed.y.values) / column.sum()
    assert apart == pytest.approx(float(flare.separation_rad(np.cos(np.radians(60)))), rel=0.01)
    assert apart > 3 * 2e-4, "several tiles above"
    together = WindscreenFlare(wedge_mrad=4.8 / 8 * np.sin(np.pi / 3) * 0.5 / 1.56)
    cosine = np.cos(np.radians(60.0))
    assert abs(together.separation_rad(cosine)) < 0.1 * flare.separation_rad(cosine)


def test_both_images_lose_the_same_share_in_the_pupil():
    blades = ApertureFlare(dust_per_mm2=0.0, scratches_per_mm2=0.0)
    lens = DiffractionLimitedLens(focal_length_mm=4.0)
    mixed = field()
    mixed.values[:] = 1.0

    def second_over_throughput(*flares):
        first = lens(mixed, flares)
        both = lens(mixed, (*flares, WindscreenFlare()))
        return (both.values - first.values) / first.attrs["throughput_sr"]

    clean = second_over_throughput()
    assert clean.max() > 1e-3
    # 1e-3: rounding errors of float32 in a difference of one percent
    np.testing.assert_allclose(second_over_throughput(blades), clean, rtol=1e-3)


def test_even_light_stays_even_and_shifts_keep_all_of_it():
    edges = np.linspace(-1.0, 1.0, 9)
    tiles = np.random.default_rng(0).uniform(0, 1, (3, 8, 2))
    np.testing.assert_allclose(shifted(tiles, edges, edges[:, None] + [0.0, 0.0]), tiles)
    half = shifted(tiles, edges, edges[:, None] + [0.125, -0.25])
    np.testing.assert_allclose(half[:, :-1, 0], (tiles[:, 1:, 0] + tiles[:, :-1, 0]) / 2)
    np.testing.assert_allclose(half[:, 1:, 1], tiles[:, :-1, 1])
    assert not half[:, 0, 1].any(), "beyond the tiles there is no light"


def test_what_it_cannot_do_is_refused():
    mixed = field(101, 3, 0.01)
    lens = IdealLens(focal_length_mm=4.0)
    with pytest.raises(ConfigError, match="meets the pane at .* flare.NAME.incidence_deg=60"):
        WindscreenFlare(incidence_deg=75.0).irradiance(lens, mixed)
    WindscreenFlare(incidence_deg=60.0).irradiance(lens, mixed)  # the suggested angle
    steep = field(101, 3, 0.03)
    with pytest.raises(ConfigError, match="incidence_deg=50, .* type .*incidence_deg=30"):
        WindscreenFlare(incidence_deg=50.0).irradiance(lens, steep)
    WindscreenFlare(incidence_deg=30.0).irradiance(lens, steep)
    WindscreenFlare().irradiance(IdealLens(distortion={}), mixed)  # no distortion
    distorting = IdealLens(distortion={"model": "brown_conrady", "k1": -0.1})
    with pytest.raises(ConfigError, match="a lens that distorts"):
        WindscreenFlare().irradiance(distorting, mixed)
