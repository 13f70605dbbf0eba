"""The denoising preview compared with more paths. The reference is a long rendering with other
random numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core.display.preview import denoised, tristimulus
from isethdr_core.extras import needed

from .transport import ERROR_OF, LONG, median_error, rendered, setting

if TYPE_CHECKING:
    import xarray as xr


def measured() -> list[Work]:
    """Return one diagram per light group: error of a tile's luminance with and without denoising.
    Seconds are those of the paths of the group and of the denoising of all groups.
    """
    long, own_errors, short = rendered()
    filters = {"plain": tristimulus, "clean": denoised, "peers": common_rule}
    truth = tristimulus(long)[:, 1]
    points_of = {name: {} for name in filters}
    for samples, (rendering, cpu_s, peak_mb) in short.items():
        for name, noise_filter in filters.items() if samples else [("plain", tristimulus)]:
            looks, more_s, more_mb = timed(
                lambda rendered_picture=rendering, way=noise_filter: way(rendered_picture)
            )
            # every view needs the tristimulus values, so plain views cost nothing more
            more_s = 0.0 if name == "plain" else more_s
            for group, look, true, source in zip(own_errors, looks, truth, long.source_seen.values):
                points_of[name].setdefault(group, []).append(
                    (
                        samples,
                        median_error(look[1], true, ~source),
                        cpu_s * rendering.took[group] + more_s,
                        max(peak_mb, more_mb),
                    )
                )
    return [
        Work(
            f"denoise {group}",
            ERROR_OF,
            f"{LONG} paths per tile, other random numbers",
            own_error,
            points(*(points_of[n][group] for n in filters)),
        )
        for group, own_error in own_errors.items()
    ]


def points(plain: Any, clean: Any, peers: Any) -> list[Point]:
    """Return the points of one group. The name of a denoised point states the number of paths
    without denoising that would give the same error.

    Parameters
    ----------
    plain : [(paths per tile, error, CPU s, peak MB)] without denoising.
    clean : [(paths per tile, error, CPU s, peak MB)] with denoising.
    peers : [(paths per tile, error, CPU s, peak MB)] with denoising by the common rule.
    """
    points_all = [
        Point(setting(n), *costs, "" if n else "default", f"{n or ''}") for n, *costs in plain
    ]
    points_all += [
        Point(f"{n} paths, denoised: as {as_paths(error, plain)}", error, *costs, "view", f"{n}")
        for n, error, *costs in clean
    ]
    return points_all + [
        Point(f"{n} paths, common rule", *costs, "peer", f"{n}") for n, *costs in peers
    ]


def as_paths(error: float, plain: Any) -> str:
    """Return the number of paths without denoising that gives an error, by linear interpolation
    between logarithms, without extrapolation.

    Parameters
    ----------
    error : error with denoising.
    plain : [(paths per tile, error, CPU s, peak MB)] without denoising.
    """
    paths, errors = (np.array(v, float) for v in zip(*((n, e) for n, e, *_ in plain if n)))
    order = np.argsort(errors)
    if error < errors.min():
        return f"more than {paths[order[0]]:.0f}"
    return f"{np.exp(np.interp(np.log(error), np.log(errors[order]), np.log(paths[order]))):.0f}"


def common_rule(scene: xr.Dataset) -> np.ndarray:
    """Return X, Y, Z (light_group, 3, y, x) after non-local means of the logarithm (scikit-image),
    with one noise level for the whole picture.
    """
    with needed("non-local means", extra="mitsuba"):
        from skimage.restoration import denoise_nl_means

    groups = []
    for xyz in tristimulus(scene):
        black = max(float(xyz[1].mean()), 1e-30) * 1e-3
        log = np.moveaxis(np.log(xyz + black), 0, -1)
        # noise that would explain all differences between neighbours
        sigma = float(np.median(np.abs(np.diff(log, axis=1)))) * 1.4826 / np.sqrt(2)
        soft = (
            denoise_nl_means(
                log, patch_size=3, patch_distance=8, h=0.8 * sigma, sigma=sigma, channel_axis=-1
            )
            if sigma > 0
            else log
        )
        groups.append(np.maximum(np.exp(np.moveaxis(soft, -1, 0)) - black, 0))
    return np.stack(groups)
