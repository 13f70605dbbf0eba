"""Linear: one capture to a picture, nothing but linear steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class LinearIsp:
    """One capture: electrons, bilinear demosaic for any filter array, colour matrix, absolute cd/m2 with variance."""

    capture: str = ""  # name of the capture to use; empty takes the first
    balance: Literal["daylight", "halogen", "led", "sodium"] = "daylight"  # light whose grey comes back exactly
    design_snr: float = 20.0  # SNR at which the colour matrix weighs shot noise against colour; inf ignores noise
    demosaic: Literal["bilinear", "guided", "malvar", "menon"] = "bilinear"  # the last two need `pip install isethdr[demosaic]`

    def __call__(self, captures):
        """Return the picture of one capture; a pixel is valid when no saturated sample went into it."""
        from .combine import fold, read_charge
        from .develop import develop
        from .readout import check_captures, chosen, readouts
        from .spectra import light

        check_captures(captures)
        one = chosen(captures, self.capture)
        [read] = readouts(one, light(self.balance, one.wavelength.values))
        merged = fold([read_charge([read], read.sensitivity[one["filter"].values])])
        return develop(merged, read.response, one, self.balance, self.design_snr, self.demosaic)
