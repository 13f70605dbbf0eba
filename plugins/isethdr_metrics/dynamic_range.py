"""Dynamic range: from the luminance that just shows to the brightest one measured, in the definitions in use."""

from __future__ import annotations

from dataclasses import dataclass

GROUPS = 20  # of dark pixels; two unknowns need a few, and each group enough pixels for a median
REACH = 12.0  # times the noise of the darkest pixels: the levels looked for lie below it, so that the line is read between points
DEPTH = 1e3  # ratio of luminances over which groups are laid; what is darker is one group
FEW = 16  # pixels of a group, at least


@dataclass(frozen=True)
class DynamicRange:
    """Largest valid luminance over that where SNR = 1 (EMVA 1288), that of dark noise, and that where SNR = 10 dB, in dB."""

    darkest_share: float = 0.2  # share of the pixels, from the dark end, whose variance is that of the dark

    def __call__(self, picture, truth, labels=None):
        """Return the range in dB by three definitions, and its ends in cd/m2.

        | score                        | lower end                                                                |
        |------------------------------|--------------------------------------------------------------------------|
        | `dynamic_range`              | SNR = 1, the absolute sensitivity threshold of EMVA 1288 (release 4)      |
        | `dynamic_range_dark_noise`   | rms noise without light, as data sheets do: flatters by the shot noise    |
        | `dynamic_range_snr_10db`     | SNR = 10 dB, rms: about where something can be recognised                 |

        The variance is fitted by a + b Y (read noise and shot noise, a and b not negative) from the dark to 12 times its noise, by
        relative least squares through the medians of groups of pixels of like luminance, so that the few dark pixels that
        flare has reached do not stand for all of them; SNR = s is where Y^2 = s^2 (a + b Y). A scene without a pixel that is not valid does not reach the sensor's
        top: the range is then a lower bound, and has no upper confidence limit. The interval of a range is the jackknife's
        over the groups of dark pixels, and the noise of the brightest pixel.
        """
        import numpy as np

        from isethdr_core import ledger
        from isethdr_core.errors import ConfigError
        from isethdr_core.scores import Score

        from .regions import NAN, luminances

        if not 0 < self.darkest_share <= 1:
            raise ConfigError(f"metric darkest_share is {self.darkest_share!r}; expected a share above 0, at most 1")
        y, true, valid = luminances(picture, truth)
        if not valid.any():
            return [Score("dynamic_range", NAN, "dB")]
        variance = picture["variance"].values[..., 1][valid]
        true, top = true[valid], float(y[valid].max())
        dark = true <= np.quantile(true, self.darkest_share)
        light, noise = medians(true, variance, max(REACH * float(np.sqrt(np.median(variance[dark]))), float(true[dark].max())))
        if np.ptp(light) < 0.1 * (light.mean() or 1.0):
            ledger.left_out("shot noise in the dark", "the darkest pixels are all alike, so a + b Y is one number", NAN, "dB")
        reached = not valid.all()
        ends = lower_ends(light, noise)
        without = [lower_ends(np.delete(light, k), np.delete(noise, k)) for k in range(len(light)) if len(light) > 2]
        top_sd = float(np.sqrt(variance[np.argmax(y[valid])])) / top if top > 0 else NAN
        scores = [Score("dynamic_range_top", top, "cd m-2")]
        for name, bottom in ends.items():
            if not (bottom > 0 and top > 0):
                ledger.left_out(f"dynamic_range{name}", "no light, or no noise without light", NAN, "dB")
                if name:
                    continue
            value = float(20 * np.log10(top / bottom)) if bottom > 0 and top > 0 else NAN
            half = 1.96 * 20 / np.log(10) * np.hypot(top_sd, jackknife_sd([w[name] for w in without]))
            scores += [Score(f"dynamic_range{name}", value, "dB", "", value - half, value + half if reached else NAN),
                       Score(f"dynamic_range{name}_bottom", float(bottom), "cd m-2")]
        return sorted(scores, key=lambda s: s.metric != "dynamic_range")  # the main one first


def medians(true, variance, reach: float) -> tuple:
    """Return the median luminance and variance of groups of pixels up to a luminance, the darkest first."""
    import numpy as np

    below = true <= reach
    true, variance = true[below], variance[below]
    group = np.ceil(GROUPS * (1 + np.log(np.maximum(true / (reach or 1.0), 1 / DEPTH)) / np.log(DEPTH))).astype(np.uint8)
    order = np.argsort(group, kind="stable")  # one byte: sorted by counting
    enough = [g for g in np.split(order, np.cumsum(np.bincount(group))[:-1]) if len(g) >= FEW]
    if len(enough) < 3:  # so few luminances, or pixels, that groups of equal numbers serve better
        enough = np.array_split(np.argsort(true, kind="stable"), min(GROUPS, len(true)))
    return tuple(np.array([np.median(values[g]) for g in enough]) for values in (true, variance))


def lower_ends(light, noise) -> dict:
    """Return the luminance of each definition, cd/m2, from the line a + b Y through (light, noise variance), a and b not negative."""
    import numpy as np
    from scipy.optimize import nnls

    level, seen = light.mean() or 1.0, noise > 0
    if not seen.any():
        return {name: 0.0 for name in ("", "_dark_noise", "_snr_10db")}
    (a, b), _ = nnls(np.stack([np.ones(seen.sum()), light[seen] / level], 1) / noise[seen, None], np.ones(seen.sum()))
    b = b / level
    return {"": (b + np.sqrt(b * b + 4 * a)) / 2, "_dark_noise": np.sqrt(a), "_snr_10db": (10 * b + np.sqrt(100 * b * b + 40 * a)) / 2}


def jackknife_sd(ends) -> float:
    """Return the standard deviation of the logarithm of a lower end from its values without one group each (Efron 1982, eq. 3.1)."""
    import numpy as np

    if len(ends) < 2 or min(ends) <= 0:
        return float("nan")
    logs = np.log(ends)
    return float(np.sqrt((len(logs) - 1) / len(logs) * np.sum((logs - logs.mean()) ** 2)))
