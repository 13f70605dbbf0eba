"""Signal to noise and contrast detection of a sensor over eight decades of light. The curves have
dips where one capture replaces another.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from isethdr_core import compose, generator
from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed
from isethdr_core.plugins.registry import build, build_from_config

DECADES = (1e-3, 1e5)  # range of luminance, cd/m2
F_NUMBER = 4.0


def level_curves(
    sensor: str = "split_pixel",
    contrast_percent: float = 20.0,
    per_decade: int = 4,
    picture: str = "",
) -> list[dict]:
    """Measure SNR and contrast detection of a sensor from 0.001 to 100 000 cd/m2.

    Parameters
    ----------
    sensor : registered name of a sensor; its captures are merged by the isp `merge`.
    contrast_percent : Michelson contrast of the pair of patches, above 0 and below 100.
    per_decade : number of levels per decade.
    picture : file for both curves (png); empty writes none.

    Returns
    -------
    rows with luminance_cd_m2 (of the brighter patch), snr_db (level over rms error, including
    saturated pixels), detection (share of pixel pairs with a measured contrast within 50 % of the
    true one, IEEE 2020) and valid_percent (of the pixels).

    Raises
    ------
    ConfigError : no pair of patches can have the contrast, or there is less than one level per
        decade.
    """
    if not 0 < contrast_percent < 100:
        raise ConfigError(
            f"contrast_percent is {contrast_percent!r}; expected percent above 0 and below 100;"
            " type contrast_percent=20"
        )
    if per_decade < 1:
        raise ConfigError(
            f"per_decade is {per_decade!r}; expected at least 1 level; type per_decade=4"
        )
    c = contrast_percent / 100
    levels = np.geomspace(*DECADES, round(np.log10(DECADES[1] / DECADES[0])) * per_decade + 1)
    see = viewer(sensor)
    rows = []
    for k, level in enumerate(levels):
        bright, true, valid = see(level, 2 * k)
        dark, _, valid_dark = see(level * (1 - c) / (1 + c), 2 * k + 1)
        total = bright + dark
        measured = (bright - dark) / np.where(total > 0, total, np.inf)
        detected = (np.abs(measured - c) <= 0.5 * c) & valid & valid_dark & (total > 0)
        rms = np.sqrt(np.mean((bright - true) ** 2))
        rows.append(
            {
                "luminance_cd_m2": float(level),
                "snr_db": float(20 * np.log10(true / rms)),
                "detection": float(detected.mean()),
                "valid_percent": float(100 * valid.mean()),
            }
        )
    if picture:
        draw(picture, rows, sensor, contrast_percent)
    return rows


def viewer(sensor: str) -> Callable[..., Any]:
    """Return a function (cd/m2, seed) -> (measured luminance of each pixel, true luminance, valid)
    for a flat patch in daylight.
    """
    mixed = build("lighting", "weights", weights={"sky": 1.0})(
        build("scene", "uniform", width=80, height=80, luminance_cd_m2=1.0)()
    )
    camera = build_from_config("sensor", compose([f"sensor={sensor}"]).sensor)
    isp = build("isp", "merge")
    focal_mm = camera.pitch_um * 1e-3 * 80 / mixed.attrs["field_width"]
    light = build("lens", "ideal", f_number=F_NUMBER, focal_length_mm=focal_mm, falloff="none")(
        mixed
    )

    def see(level: float, seed: int) -> tuple[Any, float, np.ndarray]:
        picture = isp(
            camera(light.copy(data=light.values * np.float32(level)), generator(seed=seed))
        )
        inner = (slice(8, -8), slice(8, -8))
        return (
            picture["xyz"].values[..., 1][inner].ravel(),
            level,
            np.asarray(picture["valid"].values, bool)[inner].ravel(),
        )

    return see


def draw(path: str, rows: list[dict], sensor: str, contrast_percent: float) -> None:
    """Write both curves over luminance.

    Parameters
    ----------
    path : file to write; its ending selects the format.
    rows : rows of the study, each with luminance in cd/m2, SNR in dB and detection.
    sensor : name of the sensor, for the title.
    contrast_percent : contrast of the pair of patches, percent.
    """
    with needed("a drawing", extra="report"):
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot as plt

    fig, axes = plt.subplots(2, 1, sharex=True, figsize=(8, 5.6), layout="constrained")
    luminance = [r["luminance_cd_m2"] for r in rows]
    axes[0].semilogx(luminance, [r["snr_db"] for r in rows], "-o", ms=3, color="#2c6fad")
    axes[0].set(ylabel="SNR, dB", title=f"{sensor}: flat patches in daylight, f/{F_NUMBER:g}")
    axes[1].semilogx(luminance, [r["detection"] for r in rows], "-o", ms=3, color="#c0392b")
    axes[1].set(
        ylabel=f"detection of {contrast_percent:g} % contrast",
        xlabel="luminance, cd/m2",
        ylim=(-0.03, 1.03),
    )
    for ax in axes:
        ax.grid(True, color="#eee")
    fig.savefig(path, dpi=100)
    plt.close(fig)
