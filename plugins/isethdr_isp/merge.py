"""Merge: all captures of one shot to one picture, in electrons and before the demosaic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError, UnitError, did_you_mean
from isethdr_core.pipeline.early_checks import ShotForm

from .demosaic.methods import AUTOMATIC
from .develop import PictureNoise, develop, finish, floor_e2, picture_attrs, solve_matrix
from .development_fields import Development
from .readout.black_level import with_black_level
from .readout.captures_check import check_captures
from .readout.defects import MAP
from .readout.electrons import readouts
from .readout.interleaved import has_two_cases, is_interleaved, merge_interleaved
from .readout.merge_rules import RULES
from .scene_light import illuminant
from .spectra import Illuminant, light, radiances

if TYPE_CHECKING:
    import xarray as xr

    from .readout.electrons import Readout

# Largest relative difference (rms) of electrons between captures in coloured light. Two generations
# of one photodiode differ by about 0.1, two primary colours by far more than 1.
LARGEST_MISMATCH = 0.5


@dataclass(frozen=True)
class MergeIsp(Development):
    """Merge all captures in electrons, by inverse variance without bias or by another rule, then
    develop as `linear`.
    """

    # rule that combines the captures; docs/explanation/isp.md, Merge rules
    rule: Literal["inverse_variance", "average", "poisson_sum", "isetcam"] = "inverse_variance"

    def check_shot(self, form: ShotForm) -> None:
        """Raise ConfigError if a field does not work on a filter array with upper and lower case
        letters, or for the reasons of `Development.check_shot`.
        """
        if has_two_cases(set("".join(form.filters))):
            self._check_two_cases()
        super().check_shot(form)

    def __call__(self, captures: xr.Dataset) -> xr.Dataset:
        """Return the merged picture. A pixel is valid if every sample that it uses can be read in
        some capture: it is not saturated, and five read noises below the top of its range (with
        rules other than `inverse_variance`: below 95 % of the top).

        The variable `source` (y, x) is the number of the capture with the largest weight in the
        pixel's own sample.
        """
        if self.rule not in RULES:
            raise ConfigError(f"isp rule {self.rule!r} is unknown{did_you_mean(self.rule, RULES)}")
        check_captures(captures)
        captures = with_black_level(captures, self.black)
        if is_interleaved(captures):
            return self._of_two_cases(captures)
        balance = illuminant(captures, self.balance)
        groups, per_light = charges(captures, balance)
        merged = RULES[self.rule](groups, per_light)
        state_spectral_mismatch(groups, captures.wavelength.values)
        picture = develop(merged, groups[-1], captures, self, balance)
        picture["source"] = (("y", "x"), merged.source)
        return picture

    def _check_two_cases(self) -> None:
        """Refuse fields that do not work on a filter array with upper and lower case letters."""
        for field, value, only in (
            ("rule", self.rule, "inverse_variance"),
            ("demosaic", self.demosaic, "bilinear"),
            ("denoise", self.denoise, "none"),
        ):
            if value not in (only, AUTOMATIC):
                raise ConfigError(
                    f"isp.{field}={value} cannot merge upper and lower case filters"
                    f" of one array; expected {only}; type isp.{field}={only}"
                )

    def _of_two_cases(self, captures: xr.Dataset) -> xr.Dataset:
        """Return the picture of one capture with two exposures or sensitivities in its filter
        array.
        """
        self._check_two_cases()
        if self.defects != "kept" and MAP in captures:
            raise ConfigError(
                f"isp.defects={self.defects} cannot correct an array with upper and lower case"
                " filters, whose samples are merged while they are interpolated; type"
                " isp.defects=kept, or sensor.defect_e_per_s=inf"
            )
        balance = illuminant(captures, self.balance)
        merged = merge_interleaved(captures, balance, self.shading_csv)
        dark_var_e2 = floor_e2([merged.read])
        matrix = solve_matrix(
            merged.response, captures.wavelength.values, balance, self.design_snr, dark_var_e2
        )
        # channels are independent, because each is made from its own samples
        noise = PictureNoise(
            *(
                np.tensordot(matrix**2, values, axes=1)
                for values in (merged.variances, merged.fixed)
            )
        )
        attrs = picture_attrs(captures, merged.response, self, balance, dark_var_e2)
        picture = finish(matrix, merged.planes, noise, merged.valid, captures, attrs)
        picture["source"] = (("y", "x"), np.zeros(picture["valid"].shape, np.uint8))
        return picture


def charges(captures: xr.Dataset, balance: Illuminant) -> tuple[list[list[Any]], list[np.ndarray]]:
    """Return the readings of every charge, least sensitive charge first, and for each charge the
    electrons per cd/m2 of its pixels (y, x). A single charge is not compared with others, so the
    pixels of a filter that transmits no light count as 1.

    Raises
    ------
    UnitError : there are several charges, and a filter transmits no light of `balance`.
    """
    by_charge: dict[int, list] = {}
    reads = readouts(captures, light(balance, captures.wavelength.values))
    several = len(set(captures["charge"].values.tolist())) > 1
    for number, read in zip(captures["charge"].values.tolist(), reads):
        # charges are compared by the ratio of their sensitivities
        if several and not np.all(read.sensitivity > 0):
            blind = [
                str(name)
                for name, value in zip(captures["channel"].values, read.sensitivity)
                if not value > 0
            ]
            raise UnitError(
                f"filter {', '.join(blind)} transmits no light of {balance}, so its captures cannot"
                " be compared; expected a quantum efficiency above 0 somewhere in the bands; use"
                " isp=linear, or a sensor with other filters"
            )
        by_charge.setdefault(number, []).append(read)
    groups = sorted(by_charge.values(), key=lambda reads: float(np.mean(reads[0].sensitivity)))
    filters = captures["filter"].values
    sensitivities = (reads[0].sensitivity for reads in groups)
    return groups, [np.where(per_cd > 0, per_cd, 1.0)[filters] for per_cd in sensitivities]


def state_spectral_mismatch(groups: Sequence[list[Readout]], wavelength_nm: np.ndarray) -> None:
    """State in the ledger how much captures with different filter curves disagree in coloured
    light. They agree only in the balance light.

    Raises
    ------
    UnitError : they differ by more than `LARGEST_MISMATCH`.
    """
    if len(groups) == 1:  # nothing is compared, and a sensitivity may be 0
        return
    long = groups[-1][0]
    samples = radiances(wavelength_nm)
    reference = samples @ (long.response / long.sensitivity[:, None]).T
    shorter = (samples @ (g[0].response / g[0].sensitivity[:, None]).T for g in groups[:-1])
    worst = max(
        (np.sqrt(np.mean((response / reference - 1) ** 2)) for response in shorter), default=0.0
    )
    if worst > LARGEST_MISMATCH:
        raise UnitError(
            f"the captures have different spectral responses: their electrons differ by {worst:.0%}"
            " (rms) in coloured light; expected one set of filters at different sensitivities; use"
            " isp=ideal, or isp=linear with isp.capture"
        )
    if worst > 1e-9:
        ledger.error(
            worst,
            "relative",
            "measured",
            "electrons of captures with unlike filter curves, coloured light, rms",
        )
