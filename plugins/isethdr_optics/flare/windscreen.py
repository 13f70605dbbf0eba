"""Windscreen: the second image of a pane of glass, above the first.

Light that is reflected at the rear and then at the front surface of a pane leaves it weaker and in
another direction. i is the angle of incidence, r that of refraction (sin i = n sin r), and R
Fresnel's reflectance of one surface. For unpolarised light, the second image over the first is

    t^2 sum (1 - R)^2 R^2 / sum (1 - R)^2          over both polarisations

with the inner transmittance t of one passage. The angle between the images is

    (2 d / radius) sin i / sqrt(n^2 - sin^2 i) - 2 wedge sqrt(n^2 - sin^2 i) / cos i

for a pane of thickness d that is curved in the plane of incidence, as in UN R43 for secondary
images. Both terms follow from Snell's law at small angles, and are tested against traced rays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from isethdr_core import ledger, quantities
from isethdr_core.data.camera_geometry import Identity, distortion_map, relative_illumination
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.ranges import Range, check_ranges

from ..abilities import FieldAngles
from .added_light import added_light
from .in_front import check_projection

if TYPE_CHECKING:
    import xarray as xr

    from ..abilities import LensOptics

Incidence = Annotated[float, Range(0, 80)]  # degrees
Thickness = Annotated[float, Range(0.1, 100)]  # millimetres: from a film to bullet-proof glass
Radius = Annotated[float, Range(0.1, np.inf)]  # metres; inf: flat
Wedge = Annotated[float, Range(-10, 10)]  # milliradians
Index = Annotated[float, Range(1, 3)]
InnerTransmittance = Annotated[float, Range(0, 1)]
GRAZING = 0.05  # least cosine of the angle of incidence


@dataclass(frozen=True)
class WindscreenFlare:
    """The second image that a windscreen makes of every light; default values are assumptions.

    The light that the pane takes from the first image is part of the field `transmittance` of the
    lens.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # angle between the optical axis and the normal of the pane, which leans back
    incidence_deg: Incidence = 60.0
    thickness_mm: Thickness = 4.8  # thickness of the pane
    radius_m: Radius = 8.0  # vertical curvature of the pane; inf for a flat one
    # angle between both surfaces; positive is thicker at the top, which brings both images together
    wedge_mrad: Wedge = 0.0
    index: Index = 1.52  # refractive index of the glass
    inner_transmittance: InnerTransmittance = 0.85  # transmittance of one passage through the glass

    def __post_init__(self) -> None:
        check_ranges(self)

    def share(self, cosine: np.ndarray) -> np.ndarray:
        """Return the light of the second image over that of the first.

        Parameters
        ----------
        cosine : cosine of the angle of incidence, any shape.
        """
        inside = np.sqrt(self.index**2 - 1 + cosine**2)  # n cos r
        across = ((cosine - inside) / (cosine + inside)) ** 2
        squared = self.index**2
        along = ((squared * cosine - inside) / (squared * cosine + inside)) ** 2
        first = (1 - across) ** 2 + (1 - along) ** 2
        second = ((1 - across) * across) ** 2 + ((1 - along) * along) ** 2
        return self.inner_transmittance**2 * second / first

    def separation_rad(self, cosine: np.ndarray) -> np.ndarray:
        """Return the angle by which the second image is above the first, rad.

        Parameters
        ----------
        cosine : cosine of the angle of incidence, any shape.
        """
        inside = np.sqrt(self.index**2 - 1 + cosine**2)
        sine = np.sqrt(1 - cosine**2)
        curved = 2e-3 * self.thickness_mm / self.radius_m * sine / inside
        return curved - 2e-3 * self.wedge_mrad * inside / cosine

    def cosine(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the cosine of the angle of incidence at tangents of the field (broadcast).

        Raises
        ------
        ConfigError : a line of sight grazes the pane.
        """
        tilt = np.radians(self.incidence_deg)
        cosine = (np.cos(tilt) - y * np.sin(tilt)) / np.sqrt(1 + x**2 + y**2)
        if cosine.min() < GRAZING:
            # the cosine is cos(tilt + atan y), times a factor for the distance to the side
            aside = np.sqrt(1 + x**2 / (1 + y**2))
            largest = np.arccos(np.minimum(GRAZING * aside, 1.0)) - np.arctan(y)
            raise ConfigError(
                f"flare windscreen has incidence_deg={self.incidence_deg:g}, so that the lowest"
                " line of sight meets the pane at"
                f" {np.degrees(np.arccos(np.clip(float(cosine.min()), -1.0, 1.0))):.0f} degrees;"
                f" expected {np.degrees(np.arccos(GRAZING)):.0f} or less; type for example"
                f" flare.NAME.incidence_deg={np.floor(np.degrees(largest.min())):g}"
            )
        return cosine

    def check_lens(self, lens: LensOptics, field: FieldAngles) -> None:
        """Raise ConfigError unless the field is in tangents and the lens does not distort."""
        check_projection(field.projection, "windscreen")
        if not isinstance(distortion_map(lens.distortion_to(field.widest_rad)), Identity):
            raise ConfigError(
                "flare windscreen and a lens that distorts; expected a lens without distortion;"
                " remove this flare, or type lens.distortion=none where the lens has this field"
            )

    def irradiance(self, lens: LensOptics, mixed: xr.DataArray) -> xr.DataArray:
        """Return the irradiance of the second image, W m-2 nm-1, on the tiles of `mixed`, for a
        clean round stop. Plans multiply it by the share of the light that other flares leave.

        Raises
        ------
        ConfigError : the lens has distortion, the field is given in angles, or a line of sight
            grazes the pane.
        """
        quantities.check_mixed(mixed)
        x = mixed.x.values.astype(float)
        y = mixed.y.values.astype(float)
        pitch = (quantities.tile_pitch(mixed, "y"), quantities.tile_pitch(mixed, "x"))
        widest_rad = float(np.arctan(np.hypot(np.abs(x).max(), np.abs(y).max())))
        self.check_lens(lens, FieldAngles(mixed.attrs.get("projection", "tangent"), widest_rad))
        edges = np.append(y - pitch[0] / 2, y[-1] + pitch[0] / 2)
        turn = np.tan(self.separation_rad(self.cosine(x[None, :], edges[:, None])))
        cosine = self.cosine(x[None, :], y[:, None])
        # each edge shows the second image of this direction: rotated downwards about the x axis
        source = (edges[:, None] + turn) / (1 - edges[:, None] * turn)
        sideways = np.abs(x[None, :] * edges[:, None] * turn).max() / pitch[1]
        ledger.left_out(
            "sideways part of the second image's displacement",
            "the displacement is computed along the columns only",
            float(sideways),
            "tiles",
        )
        falloff = lens.falloff_to(widest_rad)
        attrs = {"falloff": falloff}
        if isinstance(falloff, dict):
            table = {"angle_deg": list(falloff), "relative": list(falloff.values())}
            attrs = {"falloff": "table", "falloff_table": table}
        factor = self.share(cosine) * relative_illumination(attrs, x[None, :], y[:, None])
        light = shifted(np.asarray(mixed.values, float), edges, source) * factor
        return added_light(lens, mixed, light * lens.throughput_sr())


def shifted(tiles: np.ndarray, edges: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Return the means (..., y, x) of uniform tiles between other edges.

    Parameters
    ----------
    tiles : (..., y, x) values of the tiles.
    edges : (y + 1,) edges of the tiles, equidistant, in rising order.
    source : (y + 1, x) edges between which the means are taken. Beyond the tiles there is no light.
    """
    total = np.zeros((*tiles.shape[:-2], tiles.shape[-2] + 1, tiles.shape[-1]))
    np.cumsum(tiles, axis=-2, out=total[..., 1:, :])
    count = len(edges) - 1
    place = np.clip((source - edges[0]) / (edges[-1] - edges[0]) * count, 0, count)
    below = np.minimum(place.astype(int), count - 1)
    column = np.arange(tiles.shape[-1])
    low = total[..., below, column]
    upto = low + (place - below) * (total[..., below + 1, column] - low)
    return np.diff(upto, axis=-2) / (np.diff(source, axis=0) / (edges[1] - edges[0]))
