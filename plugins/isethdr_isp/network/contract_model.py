"""Model with the contract: from the planes of a shot to XYZ in electrons, then to cd/m2."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from isethdr_core import ledger
from isethdr_core.onnx_session import OnnxSession
from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.truth import VARIANCE_KNOWN, make_picture
from isethdr_core.uncertainty.error_terms import Quantity

from ..develop import picture_attrs
from ..development_fields import Development
from ..spectra import Illuminant
from .contract import LARGEST_RATIO, LEAST_RATIO, PICTURE, VARIANCE, Contract, phase
from .fields import NetworkFields
from .reach import measured_reach_px, probe
from .running import Cut, check_size, fixed_size, results_of
from .samples import (
    Shot,
    fixed_share,
    inputs,
    near_invalid,
    shot,
    state_unlike_filters,
    unit_e_per_cd_m2,
)


@dataclass(frozen=True, eq=False)
class ContractModel:
    """A model file that states the contract in its metadata."""

    session: OnnxSession
    contract: Contract

    def __post_init__(self) -> None:
        """Refuse a file with inputs or outputs that differ from its contract."""
        self.contract.check_ports(self.session)
        check_size(self.session, self.contract.multiple_px)

    @cached_property
    def cut(self) -> Cut:
        """Requirements of the model on its tiles. The reach is measured if it is not stated."""
        rows, columns = self.contract.cell.shape
        reach_px = self.contract.reach_px
        if reach_px is None:
            reach_px = measured_reach_px(self.session, probe(self.session, self.contract))
        size = fixed_size(self.session)
        return Cut((rows, columns), self.contract.multiple_px, reach_px, size)

    def check_form(self, form: ShotForm) -> None:
        """Raise ConfigError unless the model is made for the captures and filters of a sensor."""
        self.contract.check_form(form, str(self.session.path))

    def picture(self, captures: xr.Dataset, how: NetworkFields, balance: Illuminant) -> xr.Dataset:
        """Return the picture of captures with a known black level.

        Parameters
        ----------
        captures : captures Dataset with a known black level.
        how : the fields of `isp=network`.
        balance : light; views show its white as white.
        """
        contract = self.contract
        taken = shot(captures, how, apart=bool(contract.captures))
        self.check_form(taken.form())
        wavelength_nm = captures.wavelength.values
        state_unlike_filters(contract, taken, wavelength_nm)
        e_per_cd_m2 = unit_e_per_cd_m2(contract, taken)
        results = self._results(taken, how.tile_px)
        self._state_range(taken)
        known = self._variance_known()
        xyz = np.moveaxis(results[PICTURE], 0, -1) / e_per_cd_m2
        variance = np.broadcast_to(np.nan, xyz.shape)
        fixed: np.ndarray | None = None
        if known:
            squared_error_e2 = np.maximum(np.moveaxis(results[VARIANCE], 0, -1), 0.0)
            share = self._fixed_share(taken)[..., None]
            fixed = share * squared_error_e2 / e_per_cd_m2**2
            variance = (1 - share) * squared_error_e2 / e_per_cd_m2**2
        white = Development(balance=how.balance, design_snr=np.inf)
        attrs = picture_attrs(captures, taken.read.response, white, balance)
        if not known:
            attrs[VARIANCE_KNOWN] = False
        valid = ~near_invalid(taken.invalid(), self.cut.cell)
        places = (captures.x.values, captures.y.values)
        return make_picture(xyz, variance, valid, *places, fixed, **attrs)

    def _results(self, taken: Shot, tile_px: int) -> dict[str, np.ndarray]:
        """Return the outputs (3, y, x) in electrons, float64."""
        wanted = {port.name for port in self.session.inputs}
        every = inputs(taken, self.contract)
        planes = {name: plane for name, plane in every.items() if name in wanted}
        at = phase(taken.letters(), self.contract.cell) or (0, 0)
        results = results_of(self.session, planes, at, self.cut, tile_px)
        return {name: results[name].astype(float) for name in results}

    def _fixed_share(self, taken: Shot) -> np.ndarray:
        """Return the share (y, x) of the stated squared error that is fixed pattern, and state the
        largest error of this split in the ledger.

        The stated error is that of an unknown device. If the network is locally linear, it passes
        shot noise and fixed pattern alike, because both are independent from sample to sample.
        Their ratio therefore does not change. The error of the network without any noise is split
        in the same ratio. Neither part can be larger than the stated error.
        """
        share = fixed_share(taken.planes)
        median = float(np.median(share))
        ledger.error(
            max(median, 1 - median),
            "relative",
            "bound",
            f"split of the stated error: {median:.1%} of it is called fixed pattern",
            key="fixed pattern",
            acts_on=Quantity.ATTRIBUTES,
        )
        return share

    def _variance_known(self) -> bool:
        """Return whether the pictures state a variance. The ledger gets the error of the variance,
        or the reason why there is none.
        """
        stated = VARIANCE in {port.name for port in self.session.outputs}
        worst = self.contract.worst_ratio()
        if stated and worst is not None and self.contract.variance_calibrated():
            ledger.error(
                abs(worst - 1),
                "relative",
                "measured",
                f"stated over true variance of held-out scenes, worst of all levels: {worst:.2f}",
                key="variance",
                acts_on=Quantity.ATTRIBUTES,
            )
            return True
        why = "the model states none"
        if stated:
            why = "its calibration is unknown"
        if stated and worst is not None:
            why = (
                f"stated over true variance is {worst:.2f} on held-out scenes, not within"
                f" {LEAST_RATIO:g} to {LARGEST_RATIO:g}"
            )
        ledger.left_out("variance of isp network", why, np.nan, "", key="variance")
        return False

    def _state_range(self, taken: Shot) -> None:
        """State in the ledger the share of samples above the levels of the training."""
        if self.contract.range_e is None:
            return
        top_e = self.contract.range_e[1]
        share = float(np.mean(taken.planes.signal_e > top_e))
        if share:
            ledger.left_out(
                "training at this light level",
                f"{share:.1%} of the samples are above {top_e:g} e, the brightest of the training",
                np.nan,
                "",
                key="range",
            )
