"""Scene description: geometry, materials, lamps, camera and sky, in metres, candela and spectra.

A `scene` plugin makes a description, and a `renderer` plugin turns it into scene radiance. World
axes: x forward, y left, z up; metres. A model has its own origin and is placed by a 4x4 matrix.
Spectra are tables over wavelength in nm; no value is an RGB number.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..errors import ConfigError
from .fog import Fog
from .sky import SkyDome


@dataclass(frozen=True)
class Spectrum:
    """A tabulated spectrum: `value` at `wavelength_nm`, linear between, constant beyond the
    ends.

    Raises
    ------
    ConfigError : the wavelengths do not rise, or there is not one value for each of them.
    """

    wavelength_nm: tuple[float, ...]
    value: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.wavelength_nm or len(self.wavelength_nm) != len(self.value):
            raise ConfigError(
                "wavelength_nm and value of a Spectrum have the lengths"
                f" {len(self.wavelength_nm)} and {len(self.value)}; expected equal lengths of at"
                " least 1"
            )
        # interpolation between wavelengths that do not rise returns wrong values without an error
        for shorter, longer in pairwise(self.wavelength_nm):
            if not shorter < longer:
                raise ConfigError(
                    f"a Spectrum has {longer:g} nm after {shorter:g} nm; expected wavelengths that"
                    " rise"
                )

    def at(self, wavelength_nm: npt.ArrayLike) -> np.ndarray:
        """Return the values at `wavelength_nm` (any shape), in the unit of the table."""
        return np.interp(np.asarray(wavelength_nm, float), self.wavelength_nm, self.value)


def flat(value: float) -> Spectrum:
    """Return a spectrum with the same value at every wavelength."""
    return Spectrum((360.0, 830.0), (float(value), float(value)))


@dataclass(frozen=True)
class Facets:
    """Rough facets of a dielectric. They reflect by Fresnel's equations and absorb nothing."""

    roughness: float  # alpha of the distribution of slopes
    index: float  # index of refraction
    distribution: Literal["beckmann", "ggx"] = "ggx"


@dataclass(frozen=True)
class Granular:
    """A surface of grains, such as a road: matt grains that shade each other, and facets.

    BSDF = (1 - gloss) x reflectance x grains + gloss x ((1 - narrow_share) x wide + narrow_share x
    narrow). The grains are the diffuse part of Burley (2015): `flatness` 1 is proportional to 1 /
    (cos_i + cos_o), the law of Lommel and Seeliger; `flatness` 0 is nearly Lambertian.
    """

    gloss: float
    roughness: float  # roughness of the grains, 0..1
    flatness: float
    wide: Facets
    narrow: Facets
    narrow_share: float = 0.0


@dataclass(frozen=True)
class RetroReflection:
    """Light reflected back towards its source, on a share of a surface.

    The rest of the surface, 1 - `share`, reflects by the kind of the material. With t = 1 -
    cos(observation angle), h the entrance angle of the half vector, and R the reflectance, f = R
    peak (1 + t / width)^-falloff times exp(-(tan h / entrance)^power) / (cos_i cos_o) for a sheet,
    or times 1 / (cos_i + cos_o) for beads. R_A of a sheet is therefore f cos_i cos_o, cd lx-1 m-2,
    and R_L of beads hardly depends on distance.
    """

    peak: float  # height of the peak, 1/sr, at reflectance 1
    width: float  # width of the peak in t
    falloff: float  # exponent of the fall beyond `width`, above 1
    entrance: float = 1.0  # tangent of h at which the light has fallen to 1 / e
    power: float = 2.0
    form: Literal["sheet", "beads"] = "sheet"
    share: float = 0.25  # `peak` refers to the whole surface, not to `share`


@dataclass(frozen=True)
class Texture:
    """A second reflectance, mixed into the material's with a share that varies by seeded noise.

    Reflectance = (1 - m) x the material's + m x `other`, with m = 1/2 + patches n(p / patch_m) / 2
    + grain n(p / grain_m) / 2, clipped to 0..1. n is smooth noise between -1 and 1 at points p of
    the world. So the mean reflectance is half-way between the two.
    """

    other: Spectrum
    seed: int = 0
    patch_m: float = 1.0
    patches: float = 0.7  # 0..1
    grain_m: float = 0.02
    grain: float = 0.3  # 0..1


@dataclass(frozen=True)
class Material:
    """How a surface reflects. `reflectance` is 0..1; `roughness` is the Beckmann alpha (0 =
    mirror).

    diffuse: Lambertian. plastic: a Lambertian base under a rough dielectric coat of `index`.
    conductor: a rough metal of that normal-incidence reflectance.
    thin_glass: a clear pane of `index`; `reflectance` is then its inner transmittance.
    granular: as `granular` says; `reflectance` is that of the grains.
    `retro` adds retro-reflection to any opaque kind, coloured by `reflectance` too.
    """

    name: str
    kind: Literal["diffuse", "plastic", "conductor", "thin_glass", "granular"] = "diffuse"
    reflectance: Spectrum = field(default_factory=lambda: flat(0.5))
    roughness: float = 0.1
    index: float = 1.5
    granular: Granular | None = None
    retro: RetroReflection | None = None
    texture: Texture | None = None

    def mean_reflectance(self) -> Spectrum:
        """Return the mean over the texture: the reflectance half-way between the two."""
        if self.texture is None:
            return self.reflectance
        nm = sorted({*self.reflectance.wavelength_nm, *self.texture.other.wavelength_nm})
        value = (self.reflectance.at(nm) + self.texture.other.at(nm)) / 2
        return Spectrum(tuple(map(float, nm)), tuple(value.tolist()))


@dataclass(frozen=True, eq=False)
class IntensityTable:
    """Luminous intensity over two angles, linear between nodes, 0 beyond them.

    Angles are those of a lamp that stands upright and looks along its axis: `left_deg` is the
    azimuth about the vertical, `up_deg` the elevation above the horizontal plane.
    """

    left_deg: np.ndarray  # (columns,) increasing, within -90..90
    up_deg: np.ndarray  # (rows,) increasing, within -90..90
    value: np.ndarray  # (rows, columns) relative intensity, 0 or more

    def at(self, left_deg: npt.ArrayLike, up_deg: npt.ArrayLike) -> np.ndarray:
        """Return the relative intensity at angles in degrees (broadcast)."""
        left_angles, up = np.broadcast_arrays(
            np.asarray(left_deg, float), np.asarray(up_deg, float)
        )
        column, right = _cell(self.left_deg, left_angles)
        row, above = _cell(self.up_deg, up)
        low = self.value[row, column] * (1 - right) + self.value[row, column + 1] * right
        high = self.value[row + 1, column] * (1 - right) + self.value[row + 1, column + 1] * right
        inside = (left_angles >= self.left_deg[0]) & (left_angles <= self.left_deg[-1])
        inside &= (up >= self.up_deg[0]) & (up <= self.up_deg[-1])
        return np.where(inside, low * (1 - above) + high * above, 0.0)


def _cell(nodes: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell between nodes, and the place in it, 0..1."""
    cell = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    fraction = (at - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
    return cell, np.clip(fraction, 0, 1)


@dataclass(frozen=True)
class Lamp:
    """An emitting part as built: a lighting weight of 1 gives exactly this emission.

    The radiance is constant over the part. It is also constant in all directions within
    `inner_deg` of the axis. From there to `outer_deg` it falls to zero as a smoothstep of the
    cosine. The share `lambertian_share` of the total flux is added as a Lambertian floor, so that
    the lamp is never black off its axis. With both angles at 90, the lamp is Lambertian.

    With a `table` the cone is ignored: the whole part has `intensity_cd` times the table in each
    direction. Its radiance is this intensity divided by the projected area of its faces.
    """

    kind: str  # low_beam, drl, tail, brake, indicator, street, window, ...
    group: str  # light group: headlights, streetlights, other, ...
    intensity_cd: float  # luminous intensity of the whole part along its axis
    spectrum: Spectrum  # relative spectral power; only its shape matters
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)  # unit vector, model coordinates
    inner_deg: float = 90.0
    outer_deg: float = 90.0
    lambertian_share: float = 1e-3
    table: IntensityTable | None = None


@dataclass(frozen=True, eq=False)
class Part:
    """A triangle mesh of one material: `vertices` (n, 3) m, `faces` (m, 3), unit `normals` (n, 3)
    or None.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    material: str
    normals: np.ndarray | None = None
    lamp: Lamp | None = None


@dataclass(frozen=True, eq=False)
class Model:
    """A named list of parts, stored once and placed any number of times."""

    name: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class Placed:
    """One object in the world: a model at a pose. All its parts share one instance label.

    `category` is a name of `isethdr_core.data.categories`, for example `person`, `car`, `deer`,
    `road`.
    """

    name: str
    model: str
    category: str
    pose: np.ndarray  # (4, 4) model to world


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: position, line of sight, and the full horizontal and vertical field."""

    position_m: tuple[float, float, float]
    target_m: tuple[float, float, float]
    horizontal_field_deg: float = 45.0
    # width / height of the field, in tangents, or in angles where it is equidistant
    aspect: float = 16 / 9
    # projection of the grid of tiles; a tangent grid ends at 75 degrees off the axis
    projection: Literal["tangent", "equidistant"] = "tangent"


@dataclass(frozen=True, eq=False)
class NextFrame:
    """Camera and poses of objects one frame later, from which the label `motion` is computed."""

    after_s: float
    camera: Camera
    poses: tuple[np.ndarray, ...]  # (4, 4) pose of each object, in the order of the objects


@dataclass(frozen=True)
class Opening:
    """A rectangle through which the sky lights a closed space, such as the mouth of a tunnel.

    A renderer may send rays to it from inside; the expected light is the same if it does not. Its
    points are `corner_m` plus a share, 0 to 1, of `first_m` and of `second_m`, m. The cross product
    first x second points outwards.
    """

    corner_m: tuple[float, float, float]
    first_m: tuple[float, float, float]
    second_m: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SceneDescription:
    """All that a renderer needs. `objects` are labelled 1, 2, ... in their order; 0 is the sky.

    `sky` is the radiance of a uniform sky, W m-2 sr-1 nm-1, at weight 1, or a `SkyDome` with a
    radiance that depends on direction, or None for no sky. Its light group, discs of sun and moon
    included, is `sky`. The sky is above the fog, if there is any.
    """

    name: str
    models: dict[str, Model]
    objects: tuple[Placed, ...]
    materials: dict[str, Material]
    camera: Camera
    sky: Spectrum | SkyDome | None = None
    next_frame: NextFrame | None = None  # state at the next frame of a sequence
    # fog between all objects; None: clear air. Only renderers that declare it can render fog
    fog: Fog | None = None
    openings: tuple[Opening, ...] = ()  # openings that random paths to the sky rarely hit

    def light_groups(self) -> tuple[str, ...]:
        """Return the names of the groups that have an emitter, `sky` first, the others sorted."""
        lamps = {p.lamp.group for o in self.objects for p in self.models[o.model].parts if p.lamp}
        return (("sky",) if self.sky else ()) + tuple(sorted(lamps - {"sky"}))
