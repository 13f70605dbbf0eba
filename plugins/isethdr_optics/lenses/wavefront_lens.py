"""The lens `wavefront`: diffraction and a wavefront error, which may vary over the field."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.projection import angle_rad

from ..imaging.accuracy_shares import PLACES_KNOB, SPECKLE_KNOB
from .field_point_lens import FieldLens
from .limits import ErrorAllowed, FieldAngle, Zernikes


@dataclass(frozen=True)
class WavefrontLens(FieldLens):
    """Diffraction and a wavefront error in OSA/ANSI Zernike coefficients."""

    # Zernike coefficients over the stop {OSA index: rms}; index 4 is defocus
    zernike_um: Zernikes = field(default_factory=dict)
    # coefficients that are added off the axis {field angle deg: {OSA index: rms}}, for light from
    # +x; linear interpolation, rotated about the axis
    field_zernike_um: dict[FieldAngle, Zernikes] = field(default_factory=dict)
    # share of a point's light that interpolation between field points may misplace
    error_allowed: ErrorAllowed = 0.05

    accuracy_knobs = (SPECKLE_KNOB, PLACES_KNOB)  # not a field

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_field(self)

    @property
    def field_varies(self) -> bool:
        """Whether the point spread differs over the field."""
        return bool(self.field_zernike_um)

    def image_size_m(
        self, width: float, height: float, projection: str = "tangent"
    ) -> tuple[float, float]:
        """Return (width, height) in metres of the image of a field.

        Parameters
        ----------
        width, height : size of the field, in tangents of the field angle or in radians.
        projection : unit of both: `tangent` or `equidistant` (radians).

        Raises
        ------
        ConfigError : `field_zernike_um` ends within the field.
        """
        if self.field_varies:
            self.wavefront_at(float(angle_rad(width / 2, height / 2, projection)))
        return FieldLens.image_size_m(self, width, height, projection)

    def wavefront_at(self, off_axis_rad: float) -> dict[int, float]:
        """Return the coefficients {OSA index: um} that are added to `zernike_um` for light from a
        field angle along +x of the field.

        Raises
        ------
        ConfigError : the angle is larger than the last one of `field_zernike_um`.
        """
        angles_deg = list(self.field_zernike_um)
        angle = float(np.degrees(off_axis_rad))
        if angle > angles_deg[-1] * (1 + 1e-9):
            raise ConfigError(
                f"lens.field_zernike_um ends at {angles_deg[-1]:g} degrees, the field reaches"
                f" {angle:.4g}; expected a longer table, a smaller field, or less overscan"
                " (renderer.margin)"
            )
        table = self.field_zernike_um.values()
        return {
            j: float(np.interp(angle, angles_deg, [row.get(j, 0.0) for row in table]))
            for j in sorted({j for row in table for j in row})
        }


def _check_field(lens: WavefrontLens) -> None:
    angles = list(lens.field_zernike_um)
    if angles and (
        len(angles) < 2 or angles[0] != 0 or any(a >= b for a, b in zip(angles, angles[1:]))
    ):
        raise ConfigError(
            f"lens.field_zernike_um has the field angles {angles}; expected degrees that rise from"
            " 0, at least two; type for example '+lens.field_zernike_um={0:{},20:{8:0.2}}'"
        )
