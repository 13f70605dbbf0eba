"""Object contrast: does a person, a bicycle, a deer stand out from what is around it?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import once
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges
from isethdr_core.truth import before_denoising

from ..limits import Fewest, Ring
from ..regions import NAN, luminance_variance, luminances, regions_of, variance_stated


@dataclass(frozen=True)
class ObjectContrast:
    """Weber contrast of each object against a ring around it, in picture and reference picture, and
    its SNR per pixel.
    """

    ring: Ring = 0.2  # width of the ring around an object / square root of the object's area
    fewest_pixels: Fewest = 9  # objects with fewer valid pixels get no score

    def __post_init__(self):
        check_ranges(self)

    def narrow(self, demand):
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(self, picture, truth, labels=None):
        """Return three scores per object: object_contrast, object_contrast_truth,
        object_contrast_snr.

        Contrast is (mean Y of the object - mean Y of its ring) / mean Y of its ring. Its interval
        follows from the reported variance. The SNR is the difference of the means over the
        deviation of one pixel's difference.
        """
        y, true, valid = luminances(picture, truth)
        if labels is None or "instance" not in labels:
            ledger.left_out("object_contrast", "the scene has no label 'instance'", NAN, "Weber")
            return []
        undenoised = before_denoising(picture)
        variance = luminance_variance(undenoised)
        scores = []
        noisy = variance_stated(undenoised, "object_contrast_snr", "")
        for region in regions_of(y.shape, labels)[1:]:
            name = region.name
            ring = once(("ring", self.ring, name), (labels,), lambda r=region: self._ring(r))
            use = region.of(valid)
            use_around = ring.of(valid)
            pixels = int(use.sum())
            pixels_around = int(use_around.sum())
            if pixels < self.fewest_pixels or pixels_around < self.fewest_pixels:
                why = f"{pixels} valid pixels in it, {pixels_around} around it"
                ledger.left_out(f"contrast of {name}", why, NAN, "Weber")
                continue
            mean = region.of(y)[use].mean()
            surround = ring.of(y)[use_around].mean()
            if not surround:
                ledger.left_out(
                    f"contrast of {name}", "the picture shows no light around it", NAN, "Weber"
                )
                continue
            v_in = region.of(variance)[use].mean()
            v_around = ring.of(variance)[use_around].mean()
            contrast = _weber(mean, surround)
            # d(contrast) of a quotient; each mean's variance is 9 times that of independent pixels
            # at most (3 x 3 demosaic)
            spread = 3 * np.sqrt(v_in / pixels + (1 + contrast) ** 2 * v_around / pixels_around)
            half = 1.96 * spread / abs(surround)
            noise = np.sqrt(v_in + v_around)
            scores += [
                Score("object_contrast", contrast, "Weber", name, contrast - half, contrast + half),
                Score(
                    "object_contrast_truth",
                    _weber(region.of(true).mean(), ring.of(true).mean()),
                    "Weber",
                    name,
                ),
            ]
            if noise > 0:
                scores.append(
                    Score("object_contrast_snr", float(abs(mean - surround) / noise), "", name)
                )
            elif noisy:
                ledger.left_out(
                    f"object_contrast_snr of {name}", "the picture has no noise", NAN, ""
                )
        return scores

    def _ring(self, region):
        """Return the pixels around `region` within the ring's width, at least two pixels wide."""
        from scipy.ndimage import distance_transform_cdt

        width = max(2, round(self.ring * float(np.sqrt(region.mask.sum()))))
        window = tuple(
            slice(max(cut.start - width, 0), min(cut.stop + width, size))
            for cut, size in zip(region.window, region.shape, strict=True)
        )
        mask = np.zeros([cut.stop - cut.start for cut in window], bool)
        inner = tuple(
            slice(cut.start - outer.start, cut.stop - outer.start)
            for cut, outer in zip(region.window, window, strict=True)
        )
        mask[inner] = region.mask
        # steps to a neighbour above, below or beside: one pass, whatever the width
        steps = distance_transform_cdt(~mask, metric="taxicab")
        around = (steps <= width) & ~mask
        return region._replace(window=window, mask=around)


def _weber(value, surround) -> float:
    return float((value - surround) / surround) if surround else float("nan")
