"""Band parts: number of parts of about the same phase into which a band is divided."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError

from ...pupil import pupil_phase, pupil_shapes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..kernels import BandPlan

PHASE_CHANGE = 0.3  # largest change of phase from one end of a part to the other, radians rms
# least number of parts for a third-party pupil, because its phase may change with wavelength
UNKNOWN_PARTS = 2
MOST_PARTS = 16  # largest number of parts


def parts_of(plan: BandPlan, centre: float, width: float) -> int:
    """Return the number of parts of about the same phase into which a band is divided.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    centre : centre of the band, nm.
    width : width of the band, nm.
    """
    change = pupil_phase.phase_change(
        plan.lens, plan.flares, centre - width / 2, centre + width / 2
    )
    fewest = 1 if pupil_shapes.all_shapes(plan.flares) else UNKNOWN_PARTS
    return int(np.clip(np.ceil(change / PHASE_CHANGE), fewest, MOST_PARTS))


def check_delay(
    delay_um: float, wavelength_nm: ArrayLike, width_nm: np.ndarray, beside: float = 0.0
) -> None:
    """Refuse dust with a phase that changes too much within a band.

    Parameters
    ----------
    delay_um : largest optical path difference of a grain, um.
    wavelength_nm : (band,) centres of the bands, nm.
    width_nm : (band,) widths of the bands, nm.
    beside : change of the lens's own phase within a band, radians rms.

    Raises
    ------
    ConfigError : the phase of dust and lens together changes by more than `MOST_PARTS` parts can
        follow.
    """
    wave = np.asarray(wavelength_nm, float)
    width = np.asarray(width_nm, float)
    change = 2e3 * np.pi * abs(delay_um) * (1 / (wave - width / 2) - 1 / (wave + width / 2))
    worst = int(np.argmax(change))
    most = MOST_PARTS * PHASE_CHANGE
    if np.hypot(change[worst], beside) > most:
        allowed_um = 0.95 * abs(delay_um) * max(most**2 - beside**2, 0.0) ** 0.5 / change[worst]
        raise ConfigError(
            f"dust_delay_um is {delay_um:g}: within the band at {wave[worst]:g} nm,"
            f" {width[worst]:g} nm wide, its phase changes by {change[worst]:.3g}"
            f" rad{f', the lens by {beside:.3g}' if beside else ''}; expected at most {most:g} rad"
            f" together; type flare.NAME.dust_delay_um={allowed_um:.2g} or less, or use narrower"
            " bands (renderer.step_nm or scene.step_nm)"
        )
