"""Development: the fields that every isp with a colour filter array shares."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Annotated, Literal

from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.plugins.ranges import Range, check_ranges

from .demosaic.methods import check_array
from .readout.shading import read_shading


@dataclass(frozen=True)
class Development:
    """How a mosaic of electrons becomes a picture: docs/explanation/isp.md, Steps."""

    balance: Literal["daylight", "halogen", "led", "sodium"] = (
        "daylight"  # light whose grey comes back exactly
    )
    # the colour matrix weighs the noise at the light that gives this; inf ignores noise
    design_snr: Annotated[float, Range(0.1, inf)] = 20.0  # 0.1: noise hides the signal
    demosaic: Literal["bilinear", "guided", "malvar", "menon", "learned"] = (
        "bilinear"  # malvar, menon: `pip install isethdr[demosaic]`
    )
    denoise: Literal["none", "nl_means"] = "none"
    # measured relative illumination, as `isethdr_isp.readout.shading` writes it; empty takes the
    # lens's own statement
    shading_csv: str = ""

    def __post_init__(self):
        """Refuse values outside their ranges, and a table that cannot be read."""
        check_ranges(self)
        if self.shading_csv:
            read_shading(self.shading_csv)

    def check_shot(self, form: ShotForm) -> None:
        """Raise ConfigError where `demosaic` is not for the filter array."""
        check_array(self.demosaic, form.filters)

    def input_files(self):
        """Return the user's own shading table, if one is named: its content is part of a run's
        name.
        """
        return (self.shading_csv,) if self.shading_csv else ()
