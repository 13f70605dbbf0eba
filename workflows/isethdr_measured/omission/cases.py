"""Ten scenes and cameras with very different needs, each as overrides of the main job."""

from __future__ import annotations

from dataclasses import dataclass

METRICS = (
    "shares",
    "dynamic_range",
    "snr",
    "colour",
    "ssim",
    "log_luminance",
    "contrast",
    "detection",
)


@dataclass(frozen=True)
class Case:
    """One run: its overrides, and whether its scene is rendered."""

    overrides: tuple[str, ...]
    rendered: bool = False


def only(*metrics: str) -> tuple[str, ...]:
    """Return the overrides that remove all metrics except these."""
    return tuple(f"~metric.{name}" for name in METRICS if name not in metrics)


# Paths until the noise of each light group is 0.1. If they went by the noise of the cameras, those
# that one group does not need would go to the others, and the light would differ by its noise.
BY_GROUP = ("renderer.noise_share_allowed=null", "renderer.error_allowed=0.1")
TRACED = ("scene.trees=[1,2]", "report=false", *BY_GROUP)
TILES = ("renderer.width=192", "renderer.height=108")  # 0.3 of the main job's, along each axis
CHART = (
    "~renderer",
    "lighting=ideal",
    "~versions",
    "scene.width=48",
    "scene.height=32",
    "report=false",
)
CLEAN = ("~flare.dirt",)
SHARP = ("~flare.dirt", "lens=ideal")
PICTURE = ("lens.focal_length_mm=8",)  # 1.6 million pixels of 3.75 um

CASES = {
    # the lamps are off, and the sensor returns mean levels without noise
    "noon, mean": Case(
        (*TRACED, *SHARP, "lighting=day", "sensor=bayer", "sensor.noise=false"), True
    ),
    # every lamp is on and the exit is bright, so nearly everything is needed
    "tunnel": Case(
        (
            "experiment=tunnel_exit",
            *TRACED,
            *TILES,
            *CLEAN,
            "sensor=split_pixel",
            *only("log_luminance"),
        ),
        True,
    ),
    "moonless country road, headlamps": Case(
        (
            "scene=night_drive_rural",
            *TRACED,
            *TILES,
            *SHARP,
            "lighting=weights",
            "+lighting.weights.headlights=1",
            "sensor=split_pixel",
            *only("log_luminance", "dynamic_range"),
        ),
        True,
    ),
    "one lamp in the dark, mean": Case(
        (
            "scene=point_lights",
            *CHART,
            *SHARP,
            *PICTURE,
            "scene.discs=1",
            "scene.background_cd_m2=0",
            "scene.disc_diameter_deg=2",
            "sensor=split_pixel",
            "sensor.noise=false",
        )
    ),
    "five lights, dust, one noisy shot": Case(
        (
            "scene=point_lights",
            *CHART,
            "scene.disc_diameter_deg=2",
            "sensor=bayer",
            "draws=1",
            *only("log_luminance"),
        )
    ),
    "colour chart, mean": Case(
        ("scene=macbeth", *CHART, *SHARP, *PICTURE, "sensor=bayer", "sensor.noise=false")
    ),
    "colour chart to 1100 nm, infrared cut": Case(
        (
            "scene=macbeth",
            *CHART,
            *CLEAN,
            "scene.last_nm=1100",
            "scene.step_nm=5",
            "sensor=bayer",
            "draws=1",
            *only("colour"),
        )
    ),
    "edge, photons counted": Case(("scene=slanted_edge", *CHART, *SHARP, *PICTURE, "sensor=ideal")),
    "ramp, soft knee, mean": Case(
        ("scene=luminance_ramp", *CHART, *SHARP, *PICTURE, "sensor=lofic", "sensor.noise=false")
    ),
    # the light is so even that no sensor can see the wings of the lens
    "grey field, four noisy shots": Case(
        ("scene=uniform", *CHART, *CLEAN, "sensor=rgbw", *only("snr", "dynamic_range"))
    ),
}
