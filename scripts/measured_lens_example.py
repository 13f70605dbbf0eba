"""Make the bundled example of a measured lens by ray tracing of a Cooke triplet, 4 mm at f/5.6.

python scripts/measured_lens_example.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from isethdr_optics.lenses.prescription_lens import PrescribedLens

TARGET = Path(__file__).parents[1] / "plugins/isethdr_optics/measured/example.npz"
FIELD_DEG = (0.0, 7.0, 14.0, 21.0, 28.0)
WAVELENGTH_NM = (450.0, 550.0, 650.0)
PITCH_UM = 1.2
SIZE = 49


def main() -> None:
    """Trace the Cooke triplet and write its point spread functions as the bundled example."""
    lens = PrescribedLens(prescription="cooke_triplet", f_number=5.6, focal_length_mm=4.0)
    angles = np.radians(FIELD_DEG)
    spreads = [lens.at_place(a, 0.0).psf(WAVELENGTH_NM, PITCH_UM, SIZE).values for a in angles]
    psf = np.stack(spreads).astype(np.float32)
    bent = lens.distortion_to(angles[-1])
    radius = np.interp(FIELD_DEG[1:], bent["angle_deg"], bent["radius_per_focal_length"])
    percent = 100 * (radius / np.tan(angles[1:]) - 1)
    falloff = lens.falloff_to(angles[-1])
    np.savez_compressed(
        TARGET,
        psf=psf,
        pitch_um=PITCH_UM,
        field_deg=FIELD_DEG,
        wavelength_nm=WAVELENGTH_NM,
        energy=psf.sum((2, 3), dtype=float),
        relative_illumination=np.interp(FIELD_DEG, list(falloff), list(falloff.values())),
        distortion_percent=np.append(0.0, percent),
    )
    print(TARGET, TARGET.stat().st_size, "bytes")


if __name__ == "__main__":
    main()
