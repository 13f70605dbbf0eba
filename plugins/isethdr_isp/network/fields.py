"""Fields of `isp=network`."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Annotated, Literal

from isethdr_core.plugins.ranges import Range, check_ranges

from ..readout.shading import read_shading


@dataclass(frozen=True)
class NetworkFields:
    """Settings: the model, and the steps from captures to its input electrons."""

    # ONNX file of the model: docs/how-to/network_isp.md
    model: str = ""
    # rule that combines the captures for a model that takes one mosaic
    rule: Literal["inverse_variance", "average", "poisson_sum", "isetcam"] = "inverse_variance"
    # light source in which white is displayed as white; the model's XYZ do not depend on it. For a
    # model in the published layout: light source in which grey is reproduced exactly
    balance: Literal["daylight", "halogen", "led", "sodium", "automatic"] = "daylight"
    # signal-to-noise ratio for which the colour matrix after a model in the published layout is
    # solved; other models need no matrix
    design_snr: Annotated[float, Range(0.1, inf)] = 20.0
    # black level and dark charge: as the sensor states them, or the mean of its optical black rows
    black: Literal["stated", "optical"] = "stated"
    # pixels in the sensor's map of defects: kept, or interpolated from neighbours
    defects: Literal["kept", "interpolated"] = "kept"
    # file with measured relative illumination, as `isethdr_isp.readout.shading` writes it; empty:
    # the illumination that the lens states
    shading_csv: str = ""
    # side of the largest tile; it sets the memory needed, and does not change the picture. Not used
    # for a model of fixed size, which has tiles of that size
    tile_px: Annotated[int, Range(64, 16_384)] = 1024

    def __post_init__(self) -> None:
        """Refuse values outside their ranges, and a table that cannot be read."""
        check_ranges(self)
        if self.shading_csv:
            read_shading(self.shading_csv)
