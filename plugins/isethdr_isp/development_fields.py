"""Development: the fields that every isp with a colour filter array shares."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Annotated, Any, ClassVar, Literal

from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.plugins.ranges import Range, check_ranges

from .demosaic.methods import check_array
from .readout.shading import read_shading


@dataclass(frozen=True)
class Development:
    """Settings of the steps from a mosaic of electrons to a picture (docs/explanation/isp.md,
    Steps).
    """

    THREAD_SAFE: ClassVar[bool] = True

    # light source in which grey is reproduced exactly
    balance: Literal["daylight", "halogen", "led", "sodium", "automatic"] = "daylight"
    # signal-to-noise ratio for which the colour matrix is solved: low values give noise more
    # weight, inf ignores noise; below 0.1 noise hides the signal
    design_snr: Annotated[float, Range(0.1, inf)] = 20.0
    # demosaic method; malvar and menon need a Bayer array and `pip install 'isethdr[demosaic]'`;
    # learned needs an array with trained filters; automatic is learned on such an array, otherwise
    # guided
    demosaic: Literal["bilinear", "guided", "malvar", "menon", "learned", "automatic"] = "bilinear"
    # black level and dark charge: as the sensor states them, or the mean of its optical black rows
    black: Literal["stated", "optical"] = "stated"
    # pixels in the sensor's map of defects: kept, or interpolated from neighbours
    defects: Literal["kept", "interpolated"] = "kept"
    denoise: Literal["none", "nl_means"] = "none"  # denoise method, applied before the demosaic
    # strength of nl_means: samples are averaged if their surroundings differ by no more than noise
    # of this many stated standard deviations
    nl_means_strength: Annotated[float, Range(0.1, 10.0)] = 1.0
    # file with measured relative illumination, as `isethdr_isp.readout.shading` writes it; empty:
    # the illumination that the lens states
    shading_csv: str = ""

    def __post_init__(self) -> None:
        """Refuse values outside their ranges, and a table that cannot be read."""
        check_ranges(self)
        if self.shading_csv:
            read_shading(self.shading_csv)

    def check_shot(self, form: ShotForm) -> None:
        """Raise ConfigError if `demosaic` does not work on the filter array, or if the black level
        cannot be measured although `black` is "optical".
        """
        check_array(self.demosaic, form.filters)
        if self.black == "optical" and not form.black_rows:
            raise ConfigError(
                "isp.black is optical, and the sensor has no optical black rows; type"
                " sensor.black_rows=16, or isp.black=stated"
            )

    def input_files(self) -> tuple[Any, ...]:
        """Return the user's shading table, if set. Its content is part of the name of a run."""
        return (self.shading_csv,) if self.shading_csv else ()
