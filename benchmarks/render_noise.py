"""The noise that single renderings state per tile and per light group, against the spread of many
renderings.

Two scenes are rendered at 48 x 27 tiles and 4 bands. A rendering is four passes of 4 or 16 paths
per tile. The true noise follows from the spread of the passes of all renderings, of which there are
`RENDERINGS`; the true light is their mean. Tiles above 1 % of a group's mean count. The sky is left
out, because its noise is below a thousandth. Run:

    python benchmarks/render_noise.py
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from render_error_allowed import NORMAL, luminance_of, passes_of

RENDERINGS = {4: 200, 16: 50}  # number of renderings by the number of paths of a pass


def main():
    """Print one row per scene, group and number of paths; names given on the command line choose
    among the scenes.
    """
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant
    from isethdr_mitsuba.paths.passes import Frame
    from isethdr_mitsuba.renderer import MitsubaRenderer

    import isethdr_core as hdr

    mi.set_variant(choose_variant("llvm"))
    settings = MitsubaRenderer(width=48, height=27, margin=0.0, step_nm=100.0)
    for name, seed in (("night_drive", 23), ("tunnel", 11)):
        if not sys.argv[1:] or name in sys.argv[1:]:
            one_pass, groups, bands, shape = passes_of(
                hdr.build("scene", name, seed=seed)(), settings
            )
            for paths, count in RENDERINGS.items():
                frame = Frame(groups, bands, shape)
                rows(f"{name} (seed {seed})", one_pass, frame, settings, paths, count)


def rows(name, one_pass, frame, settings, paths, count):
    """Print the rows of one scene and one number of paths per pass."""
    from isethdr_mitsuba.paths.passes import estimate, weighted_median

    groups = frame.groups
    bands = frame.wavelength_nm
    passes = [list(one_pass(k, paths, None)) for k in range(4 * count)]
    # (pass, group, tile)
    light = np.stack(
        [
            luminance_of(
                np.reshape([v for _, _, v in one], (len(groups), len(bands), *frame.shape)), bands
            )
            for one in passes
        ]
    )
    true = light.std(0, ddof=1) / 2
    mean = light.mean(0)
    replay = iter(passes)
    estimates = [
        estimate(lambda *_: next(replay), replace(settings, samples=4 * paths), frame)
        for _ in range(count)
    ]
    for g, group in enumerate(groups):
        if group == "sky":  # its noise is below a thousandth
            continue
        used = mean[g] > 0.01 * mean[g].mean()
        stated = np.stack([f.xyz_noise[g, 1].ravel()[used] for f in estimates])
        off = np.abs(light[:, g, used].reshape(count, 4, -1).mean(1) - mean[g, used])
        ratio = true[g, used] / np.maximum(stated, 1e-300)
        # as in `render_error_allowed`: the error of the median tile, which is 0.6745 of the noise
        # if that is normal
        whole = (
            np.median([weighted_median(one / mean[g, used], mean[g, used]) for one in off]) / NORMAL
        )
        print(
            f"{name} {group:13s} {4 * paths:4d} paths: true / stated: median tile"
            f" {np.median(ratio):.2f}, nine of ten below {np.quantile(ratio, 0.9):.1f}, rms"
            f" {np.sqrt(np.mean(true[g, used] ** 2) / np.mean(stated**2)):.2f}; beyond 2 stated"
            f" {100 * np.mean(off > 2 * stated):.1f} %, beyond 3"
            f" {100 * np.mean(off > 3 * stated):.1f} %; group: true {whole:.3f}, / stated"
            f" {whole / np.median([f.noise[g] for f in estimates]):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main())
