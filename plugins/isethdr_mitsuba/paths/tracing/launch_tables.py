"""Launch tables: the scene, the spectra and the work items of a launch on the device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi

if TYPE_CHECKING:
    from ...lamps.airlight_sampling import AirlightLamps
    from ...lamps.lamp_tables import LampTables
    from ..camera_rays import Camera
    from ..fog_tables import FogTables
    from ..hits import HitTables
    from ..surface_tables import SurfaceTables

Light = list[list[Any]]  # [group][packet of four bands]


class Spectra:
    """The `BandTable` of a pass on the device."""

    def __init__(self, values: Any, rows: Any, lights: Any, places: Any, packets: int) -> None:
        """Keep the table of a pass.

        Parameters
        ----------
        values : wavelength samples of all rows, in packets.
        rows : number of rows; the last ones are the means of the rows of the sky.
        lights : number of the first row of a lamp.
        places : number of wavelength samples in each band.
        packets : number of packets of four bands.
        """
        self.values = values
        self.rows = rows
        self.lights = lights
        self.places = places
        self.packets = packets

    def place(self, along: Any) -> Any:
        """Return the index of the wavelength sample at `along`, a share of 2^32, in each band."""
        return mi.UInt32(dr.mul_hi(along, self.places))

    def at(self, place: Any, row: Any, active: Any) -> list[Any]:
        """Return row `row` at the sample `place`, as a list of packets.

        Parameters
        ----------
        place : wavelength sample in each band.
        row : row of a material, a lamp or the sky.
        active : lanes that take part.
        """
        return [
            dr.gather(
                mi.Spectrum, self.values, (place * self.rows + row) * self.packets + k, active
            )
            for k in range(self.packets)
        ]


class Tables:
    """A scene on the device. Not a tuple or a dataclass, because loops of Dr.Jit would take those
    apart.

    Attributes
    ----------
    fog, air : tables of fog, and of lamps for its airlight; None in clear air.
    """

    def __init__(
        self,
        scene: Any,
        hits: HitTables,
        camera: Camera,
        lamps: LampTables,
        surfaces: SurfaceTables,
        spectra: Spectra,
    ) -> None:
        """Keep the tables of a scene in clear air.

        Parameters
        ----------
        scene : scene of Mitsuba.
        hits : triangles, and poses of instances.
        camera : view.
        lamps : light groups, lamps and sky.
        surfaces : materials.
        spectra : spectra of materials, lamps and sky.
        """
        self.scene: mi.Scene = scene
        self.hits = hits
        self.camera = camera
        self.lamps = lamps
        self.surfaces = surfaces
        self.spectra = spectra
        self.fog: FogTables | None = None
        self.air: AirlightLamps | None = None


class Items(NamedTuple):
    """`Work` on the device: one entry per work item."""

    row: mi.UInt32
    column: mi.UInt32
    tile: mi.UInt32  # number from which the random numbers of the tile follow
    owner: mi.UInt32  # entry of the result that the light is added to
    lane: mi.UInt32  # position among the items of the same tile
    lanes: mi.UInt32  # number of items of the same tile
    paths: mi.UInt32  # number of paths to follow
    shares: mi.UInt32  # largest number of paths that share a camera ray
    groups: mi.UInt32  # bit mask of the light groups to compute
