"""Object contrast: does a person, a bicycle, a deer stand out from what is around it?"""

from __future__ import annotations

from dataclasses import dataclass

from isethdr_core.plugins.ranges import check_ranges

from ..limits import Fewest, Ring


@dataclass(frozen=True)
class ObjectContrast:
    """Weber contrast of each object against a ring around it, in picture and truth, and the
    contrast's SNR per pixel.
    """

    ring: Ring = 0.2  # width of the ring over the square root of the object's area
    fewest_pixels: Fewest = 9  # objects with fewer valid pixels are left out

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
        import numpy as np

        from isethdr_core import ledger
        from isethdr_core.data.scores import Score

        from ..regions import (
            NAN,
            frame_and_objects,
            luminance_variance,
            luminances,
            variance_stated,
        )

        y, true, valid = luminances(picture, truth)
        if labels is None or "instance" not in labels:
            ledger.left_out("object_contrast", "the scene has no label 'instance'", NAN, "Weber")
            return []
        variance, scores = luminance_variance(picture), []
        noisy = variance_stated(picture, "object_contrast_snr", "")
        for name, mask in list(frame_and_objects(y.shape, labels))[1:]:
            ring = self._ring(mask)
            inside, around = mask & valid, ring & valid
            if inside.sum() < self.fewest_pixels or around.sum() < self.fewest_pixels:
                why = f"{inside.sum()} valid pixels in it, {around.sum()} around it"
                ledger.left_out(f"contrast of {name}", why, NAN, "Weber")
                continue
            mean, surround = y[inside].mean(), y[around].mean()
            if not surround:
                ledger.left_out(
                    f"contrast of {name}", "the picture shows no light around it", NAN, "Weber"
                )
                continue
            v_in, v_around = variance[inside].mean(), variance[around].mean()
            contrast = _weber(mean, surround)
            # d(contrast) of a quotient; each mean's variance is 9 times that of independent pixels
            # at most (3 x 3 demosaic)
            spread = 3 * np.sqrt(
                v_in / inside.sum() + (1 + contrast) ** 2 * v_around / around.sum()
            )
            half = 1.96 * spread / abs(surround)
            noise = np.sqrt(v_in + v_around)
            scores += [
                Score("object_contrast", contrast, "Weber", name, contrast - half, contrast + half),
                Score(
                    "object_contrast_truth",
                    _weber(true[mask].mean(), true[ring].mean()),
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

    def _ring(self, mask):
        """Return the pixels around `mask` within the ring's width, at least two pixels wide."""
        import numpy as np
        from scipy.ndimage import binary_dilation

        width = max(2, round(self.ring * float(np.sqrt(mask.sum()))))
        rows, columns = np.nonzero(mask)
        window = tuple(slice(max(i.min() - width, 0), i.max() + width + 1) for i in (rows, columns))
        out = np.zeros_like(mask)
        out[window] = binary_dilation(mask[window], iterations=width) & ~mask[window]
        return out


def _weber(value, surround) -> float:
    return float((value - surround) / surround) if surround else float("nan")
