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
        values : samples of all rows, in packets.
        rows : number of rows; the last are the means of those of the sky.
        lights : number of the first row of a lamp.
        places : wavelength samples in each band.
        packets : of four bands.
        """
        self.values = values
        self.rows = rows
        self.lights = lights
        self.places = places
        self.packets = packets

    def place(self, along: Any) -> Any:
        """Return the index of the wavelength sample at position `along` (of 2^32) in each band."""
        return mi.UInt32(dr.mul_hi(along, self.places))

    def at(self, place: Any, row: Any, active: Any) -> list[Any]:
        """Return row `row` at the sample `place`, as a list of packets.

        Parameters
        ----------
        place : wavelength sample in each band.
        row : of a material or of a lamp.
        active : lanes that take part.
        """
        return [
            dr.gather(
                mi.Spectrum, self.values, (place * self.rows + row) * self.packets + k, active
            )
            for k in range(self.packets)
        ]


class Tables:
    """A scene on the device. No tuple and no dataclass, which loops of Dr.Jit would take apart.

    Attributes
    ----------
    fog, air : None in clear air.
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
        hits : triangles, and places of instances.
        camera : view.
        lamps : light groups, lamps, sky.
        surfaces : materials.
        spectra : of materials and lamps.
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
    tile: mi.UInt32  # number that random numbers go by
    owner: mi.UInt32  # entry of the result that the light is added to
    lane: mi.UInt32
    lanes: mi.UInt32  # of the same tile
    paths: mi.UInt32  # to follow
    shares: mi.UInt32  # paths that share a camera ray, at most
    groups: mi.UInt32  # bits of the light groups that are wanted
