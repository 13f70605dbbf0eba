"""Network isp: a trained model develops captures to a picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import xarray as xr

from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.early_checks import ShotForm

from ..readout.black_level import with_black_level
from ..readout.captures_check import check_captures
from ..readout.interleaved import has_two_cases
from ..scene_light import illuminant
from .fields import NetworkFields
from .model_file import needs_model, opened
from .samples import TWO_EXPOSURES


@dataclass(frozen=True)
class NetworkIsp(NetworkFields):
    """Develop the captures by a trained network from an ONNX file, from electrons to absolute XYZ,
    in overlapping tiles.
    """

    THREAD_SAFE: ClassVar[bool] = True

    def input_files(self) -> Iterable[str | Path]:
        """Return the model file, and the shading table if one is set. Their content is part of the
        name of a run.
        """
        return (needs_model(self.model), *filter(None, [self.shading_csv]))

    def check_shot(self, form: ShotForm) -> None:
        """Raise ConfigError if the filter array holds two exposures, if the model cannot be read or
        is made for another sensor, or if the black level cannot be measured although `black` is
        "optical".
        """
        if has_two_cases(set("".join(form.filters))):
            raise ConfigError(TWO_EXPOSURES)
        opened(self.model).check_form(form)
        if self.black == "optical" and not form.black_rows:
            raise ConfigError(
                "isp.black is optical, and the sensor has no optical black rows; type"
                " sensor.black_rows=16, or isp.black=stated"
            )

    def __call__(self, captures: xr.Dataset) -> xr.Dataset:
        """Return the picture. A pixel is valid if all samples at a distance of less than one cell
        of the filter array are unsaturated in some capture.
        """
        model = opened(self.model)
        check_captures(captures)
        captures = with_black_level(captures, self.black)
        return model.picture(captures, self, illuminant(captures, self.balance))
