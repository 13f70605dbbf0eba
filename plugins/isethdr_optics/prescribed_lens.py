"""The lens `prescription`: diffraction at the stop, with the relative illumination and f-number of a traced lens prescription."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from .lens import DiffractionLimitedLens

FIELD_POINTS = 33  # of the relative illumination, across the field


@dataclass(frozen=True)
class PrescribedLens(DiffractionLimitedLens):
    """A real lens from its prescription: vignetting, pupil aberration and throughput by exact rays; blur by diffraction alone."""

    prescription: str = "double_gauss"  # name, or path of a .yaml file; scaled to focal_length_mm, stopped to f_number

    def __post_init__(self):
        super().__post_init__()
        self.real()

    def __call__(self, mixed, flares=()):
        """Return irradiance of mixed radiance; traced relative illumination in place of cos4 (`falloff: none`: neither)."""
        from isethdr_core import ledger, quantities

        quantities.check_mixed(mixed)
        self._state(mixed, ledger)
        if self.falloff == "none":
            return super().__call__(mixed, flares)
        return super().__call__(mixed.copy(data=mixed.values * self._beyond_cos4(mixed)), flares)

    def input_files(self):
        """Return the user's own prescription file, if one is named: its content is part of a run's name."""
        return (self.prescription,) if self.prescription.endswith((".yaml", ".yml")) else ()

    def real(self):
        """Return the `Prescription`, scaled and stopped down."""
        from .prescription import load

        return load(self.prescription).scaled(self.focal_length_mm).stopped(self.f_number)

    def throughput_sr(self) -> float:
        """Return irradiance / radiance on the axis, sr: pi sin^2 of the traced marginal ray's angle, times transmittance."""
        from .prescription_figures import working_f_number

        return self.transmittance * 3.141592653589793 / (4 * (working_f_number(self.real()) * (1 + self.magnification)) ** 2)

    def relative_illumination(self, tangent):
        """Return irradiance of a uniform scene at field tangents, 1 on the axis, without distortion: the lens keeps the grid."""
        import numpy as np

        from .prescription_figures import pupil_area_mm2

        tangent = np.abs(np.atleast_1d(np.asarray(tangent, float)))
        area = pupil_area_mm2(self.real(), np.concatenate([[0.0], tangent]))
        return (1 + tangent**2) ** -2 * area[1:] / area[0]

    def distortion(self, largest_tangent: float):
        """Return the traced distortion up to a field tangent, a map of `isethdr_optics.distortion`."""
        from .distortion import of_prescription

        return of_prescription(self.real(), largest_tangent)

    def _beyond_cos4(self, mixed):
        """Return the relative illumination over cos4, (y, x) tiles: the area of the beam at its field over that on the axis."""
        import numpy as np

        radius = np.hypot(mixed.x.values[None, :], mixed.y.values[:, None])
        return np.interp(radius, *_areas(self.real(), float(radius.max())))

    def _state(self, mixed, ledger):
        """State what the prescription would do that this lens does not, at the border of the field it is made for."""
        import numpy as np

        from .prescription_figures import distortion, spot_radius_mm

        real = self.real()
        edge = min(float(np.hypot(mixed.x.max(), mixed.y.max())), float(np.tan(np.radians(real.half_field_deg))))
        bent = abs(float(distortion(real, edge)[0])) if edge > 0 else 0.0
        ledger.left_out("distortion of the prescription", "the lens keeps the grid", bent, "of the position")
        spot = max(spot_radius_mm(real, t) for t in (0.0, 0.7 * edge, edge))
        ledger.left_out(
            "geometric aberrations of the prescription", "its blur is diffraction alone", spot * 1e-3, "m (rms radius)"
        )


@lru_cache(maxsize=16)
def _areas(real, largest):
    """Return field tangents up to `largest`, and there the area of the beam over that on the axis."""
    import numpy as np

    from .prescription_figures import pupil_area_mm2

    tangent = np.linspace(0, max(largest, 1e-9), FIELD_POINTS)
    area = pupil_area_mm2(real, tangent)
    return tangent, area / area[0]
