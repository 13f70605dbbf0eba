"""Merge: all captures of one shot to one picture, in electrons and before the demosaic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LARGEST_MISMATCH = 0.5  # two generations of one photodiode differ by about 0.1, two primary colours by far more than 1


@dataclass(frozen=True)
class MergeIsp:
    """All captures merged in electrons by inverse variance without bias, then as `linear`; ISETCam's rule by name."""

    rule: Literal["inverse_variance", "isetcam"] = "inverse_variance"  # isetcam: hard switch at 95 % of the top
    balance: Literal["daylight", "halogen", "led", "sodium"] = "daylight"  # light whose grey comes back exactly
    design_snr: float = 20.0  # SNR at which the colour matrix weighs shot noise against colour; inf ignores noise

    def __call__(self, captures):
        """Return the merged picture; a pixel is valid when every sample in it is unsaturated in some capture."""
        import numpy as np

        from isethdr_core.errors import ConfigError, did_you_mean

        from .combine import fold, isetcam_saturated, read_charge
        from .develop import develop
        from .readout import check_captures, readouts
        from .spectra import light

        if self.rule not in ("inverse_variance", "isetcam"):
            raise ConfigError(f"isp rule {self.rule!r} is unknown{did_you_mean(self.rule, ('inverse_variance', 'isetcam'))}")
        check_captures(captures)
        by_charge: dict[int, list] = {}
        reads = readouts(captures, light(self.balance, captures.wavelength.values))
        for number, read in zip(captures["charge"].values.tolist(), reads):
            by_charge.setdefault(number, []).append(read)
        groups = sorted(by_charge.values(), key=lambda reads: float(np.mean(reads[0].sensitivity)))
        filters = captures["filter"].values
        per_light = [reads[0].sensitivity[filters] for reads in groups]
        if self.rule == "isetcam":
            signal, variance, valid = isetcam_saturated(groups, per_light)
        else:
            signal, variance, valid = fold([read_charge(reads, level) for reads, level in zip(groups, per_light)])
        _state_spectral_mismatch(groups, captures.wavelength.values)
        return develop(signal, variance, valid, groups[-1][0].response, captures, self.balance, self.design_snr)


def _state_spectral_mismatch(groups, wavelength_nm) -> None:
    """State how far captures of unlike filter curves disagree on coloured light: they agree on the balance light only."""
    import numpy as np

    from isethdr_core import ledger
    from isethdr_core.errors import UnitError

    from .spectra import radiances

    long, samples = groups[-1][0], radiances(wavelength_nm)
    reference = samples @ (long.response / long.sensitivity[:, None]).T
    shorter = (samples @ (g[0].response / g[0].sensitivity[:, None]).T for g in groups[:-1])
    worst = max((np.sqrt(np.mean((seen / reference - 1) ** 2)) for seen in shorter), default=0.0)
    if worst > LARGEST_MISMATCH:
        raise UnitError(f"the captures see different colours: their electrons differ by {worst:.0%} (rms) on coloured light; "
                        "expected one set of filters, seen more or less brightly; use isp=ideal, or isp=linear with isp.capture")
    if worst > 1e-9:
        ledger.error(worst, "relative", "measured", "electrons of captures with unlike filter curves, coloured light, rms")
