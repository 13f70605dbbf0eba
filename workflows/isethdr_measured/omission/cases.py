"""Ten scenes and cameras of very different need, each as overrides of the main job."""

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
    """One run: its overrides, and whether its scene has to be rendered."""

    overrides: tuple[str, ...]
    rendered: bool = False


def only(*metrics: str) -> tuple[str, ...]:
    """Return the overrides that take away all metrics but these."""
    return tuple(f"~metric.{name}" for name in METRICS if name not in metrics)


# the main job's tiles, as many paths as the noise takes
TRACED = (
    "scene.trees=[1,2]",
    "report=false",
)
TILES = ("renderer.width=192", "renderer.height=108")  # or 0.3 of them each way
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
    # lamps off, levels alone: no lamp, no noise
    "noon, mean": Case(
        (*TRACED, *SHARP, "lighting=day", "sensor=bayer", "sensor.noise=false"), True
    ),
    # every lamp is on and the exit is bright: nearly all of it is needed
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
    # light so even that no sensor sees where the lens spreads it far
    "grey field, four noisy shots": Case(
        ("scene=uniform", *CHART, *CLEAN, "sensor=rgbw", *only("snr", "dynamic_range"))
    ),
}
