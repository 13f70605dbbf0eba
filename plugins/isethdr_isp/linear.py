"""Linear: one capture to a picture, by linear steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.pipeline.early_checks import ShotForm

from .develop import develop
from .development_fields import Development
from .readout.black_level import with_black_level
from .readout.captures_check import check_captures
from .readout.combine import fold, read_charge
from .readout.electrons import chosen, readouts
from .scene_light import illuminant
from .spectra import light

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class LinearIsp(Development):
    """Develop one capture: electrons, demosaic for any filter array, colour matrix, absolute cd/m2
    with variance.
    """

    capture: str = ""  # name of the capture to develop; empty takes the first

    def check_shot(self, form: ShotForm) -> None:
        """Raise ConfigError if no capture has the name `capture`, or for the reasons of
        `Development.check_shot`.
        """
        if self.capture and self.capture not in form.captures:
            raise ConfigError(
                f"isp.capture is {self.capture!r}; expected the name of a capture of every sensor"
                f"{did_you_mean(self.capture, form.captures)}; "
                f"type isp.capture={form.captures[0]}"
            )
        super().check_shot(form)

    def __call__(self, captures: xr.Dataset) -> xr.Dataset:
        """Return the picture of one capture. A pixel is valid if every sample that it uses is at
        least five read noises below the top of its range.
        """
        check_captures(captures)
        capture = with_black_level(chosen(captures, self.capture), self.black)
        balance = illuminant(capture, self.balance)
        [read] = readouts(capture, light(balance, capture.wavelength.values))
        merged = fold([read_charge([read], read.sensitivity[capture["filter"].values])])
        return develop(merged, [read], capture, self, balance)
