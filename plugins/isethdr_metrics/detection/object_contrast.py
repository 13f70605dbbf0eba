"""Object contrast: whether an object, such as a person or a deer, stands out from its surround."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import once
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Fewest, Ring
from ..regions import (
    NAN,
    luminance_variance,
    luminances,
    regions_of,
    undenoised,
    variance_stated,
)

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand

    from ..regions import Region

# largest ratio of the variance of a mean over pixels to that of independent pixels, after a 3 x 3
# demosaic
SHARED_NOISE = 9.0


class Sample(NamedTuple):
    """The valid pixels of a region, before denoising."""

    luminance: np.ndarray  # (pixel,), cd/m2
    variance: np.ndarray  # (pixel,), temporal, (cd/m2)^2


class Detectability(NamedTuple):
    """Difference between the mean of an object and that of its ring, in standard deviations."""

    by_noise: float  # relative to the temporal noise of both means
    with_clutter: float  # relative to that noise and the spread of the ring together


@dataclass(frozen=True)
class ObjectContrast:
    """Weber contrast of each object against a ring around it, in picture and reference picture, its
    SNR per pixel, and its detectability d'.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # width of the ring around an object / square root of the object's area; at least 2 pixels
    ring: Ring = 0.2
    # objects with fewer valid pixels, or with fewer in the ring around them, get no score
    fewest_pixels: Fewest = 9

    def __post_init__(self) -> None:
        check_ranges(self)

    def narrow(self, demand: Demand) -> Demand:
        """Ask for the instance labels."""
        return demand.with_labels("instance")

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Any]:
        """Return five scores per object: object_contrast, object_contrast_truth,
        object_contrast_snr, object_d_prime, object_d_prime_clutter.

        Contrast is (mean Y of the object - mean Y of its ring) / mean Y of its ring. Its interval
        follows from the stated variance. The SNR is the difference of the means divided by the
        standard deviation of the difference of two single pixels. d' (`detectability`) is the
        difference of the means divided by the standard deviation of the means, before denoising:
        by temporal noise alone, and with the spread of the ring. Without light in the ring of the
        reference picture, object_contrast_truth is left out.
        """
        y, true, valid = luminances(picture, truth)
        if labels is None or "instance" not in labels:
            ledger.left_out("object_contrast", "the scene has no label 'instance'", NAN, "Weber")
            return []
        shown = undenoised(picture)
        variance = luminance_variance(shown)
        plain = luminances(shown, truth)[0]
        temporal = shown["variance"].values[..., 1]
        y, true, valid, variance, plain, temporal = (
            values.ravel() for values in (y, true, valid, variance, plain, temporal)
        )
        scores = []
        noisy = variance_stated(shown, "object_contrast_snr", "")
        for region in regions_of(picture["valid"].shape, labels)[1:]:
            name = region.name
            whole, ring = once(
                ("object and ring", self.ring, name),
                (labels,),
                lambda r=region: (r.pixels(), self._ring(r).pixels()),
            )
            inside = whole[valid[whole]]
            around = ring[valid[ring]]
            pixels = inside.size
            pixels_around = around.size
            if pixels < self.fewest_pixels or pixels_around < self.fewest_pixels:
                why = f"{pixels} valid pixels in it, {pixels_around} around it"
                ledger.left_out(f"contrast of {name}", why, NAN, "Weber")
                continue
            mean = y[inside].mean()
            surround = y[around].mean()
            if not surround:
                ledger.left_out(
                    f"contrast of {name}", "the picture shows no light around it", NAN, "Weber"
                )
                continue
            contrast_of_truth = once(
                ("object contrast", self.ring, name),
                (truth, labels),
                lambda w=whole, r=ring: _weber(true[w].mean(), true[r].mean()),
            )
            v_in = variance[inside].mean()
            v_around = variance[around].mean()
            contrast = _weber(mean, surround)
            # propagation of errors in a quotient; the variance of each mean is at most 9 times that
            # of independent pixels (3 x 3 demosaic)
            spread = 3 * np.sqrt(v_in / pixels + (1 + contrast) ** 2 * v_around / pixels_around)
            half = 1.96 * spread / abs(surround)
            noise = np.sqrt(v_in + v_around)
            scores.append(
                Score("object_contrast", contrast, "Weber", name, contrast - half, contrast + half)
            )
            if np.isfinite(contrast_of_truth):
                scores.append(Score("object_contrast_truth", contrast_of_truth, "Weber", name))
            else:
                why = "the reference picture shows no light around it"
                ledger.left_out(f"object_contrast_truth of {name}", why, NAN, "Weber")
            if noise > 0:
                scores.append(
                    Score("object_contrast_snr", float(abs(mean - surround) / noise), "", name)
                )
                found = detectability(
                    Sample(plain[inside], temporal[inside]), Sample(plain[around], temporal[around])
                )
                if np.isfinite(found.by_noise):  # inf without temporal noise
                    scores += [
                        Score("object_d_prime", found.by_noise, "", name),
                        Score("object_d_prime_clutter", found.with_clutter, "", name),
                    ]
            elif noisy:
                ledger.left_out(
                    f"object_contrast_snr of {name}", "the picture has no noise", NAN, ""
                )
        return scores

    def _ring(self, region: Region) -> Region:
        """Return the ring of pixels around `region`, at least two pixels wide."""
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
        # taxicab distance, which needs one pass whatever the width
        steps = distance_transform_cdt(~mask, metric="taxicab")
        around = (steps <= width) & ~mask
        return region._replace(window=window, mask=around)


def detectability(inside: Sample, around: Sample) -> Detectability:
    """Return d' of an object against its ring; inf without temporal noise.

    Parameters
    ----------
    inside, around : pixels of the object and of its ring, one or more each.

    Notes
    -----
    d' = |m - r| / sigma (Green, Swets 1966), where m and r are the mean luminances of object and
    ring. For noise alone, sigma^2 = 9 (v / n + w / k), with the mean temporal variances v and w of
    the n and k pixels. The factor 9 is an upper limit for noise that a 3 x 3 demosaic shares
    between pixels, so d' is a lower limit. With clutter, the variance over the pixels of the ring
    minus w is added. It contains the texture of the ground and the fixed pattern, which in a single
    shot look like objects of one pixel.
    """
    noise = SHARED_NOISE * sum(of.variance.mean() / of.variance.size for of in (inside, around))
    clutter = max(float(around.luminance.var() - around.variance.mean()), 0.0)
    difference = abs(float(inside.luminance.mean() - around.luminance.mean()))
    by_noise, with_clutter = (
        difference / np.sqrt(v) if v > 0 else float("inf") for v in (noise, noise + clutter)
    )
    return Detectability(float(by_noise), float(with_clutter))


def _weber(value: float, surround: float) -> float:
    return float((value - surround) / surround) if surround else float("nan")
