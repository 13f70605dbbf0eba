"""isethdr_mitsuba: turns a scene description into scene radiance with Mitsuba 3.

renderer.py        the component `mitsuba`: fields, demand, what is stated in the ledger
view.py            the camera's tiles as tangents or angles, margin included
straight.py        triangles on a grid of angles, cut up until their sides are straight there
frame.py           one frame: world, passes, lamps seen directly, labels, and the Dataset made of them
placed_lamps.py    lamps in the world: candela into radiance, beam pattern, projected area
lamp_tables.py     lamps as lookup tables on the device, and how a shadow ray's target is chosen
lamp_chances.py    how likely a lamp is to be looked at, by what it sends to that part of the picture
integrator.py      one path, all bands, all light groups
camera_rays.py     where the paths of a tile begin: points and wavelengths, spread evenly
radiance.py        passes of that integrator, summed in float64, with their spread; until it is small enough
visible_lamps.py   lamps seen directly, with their exact footprint on the tiles
materials.py       material kinds as Mitsuba surfaces
hits.py            where a ray meets which triangle, by tables of all of them: no code of any one shape
surface_tables.py  which material a ray met, and one evaluation of it for all bands
spectra.py         all spectra in one table, band by band at the wavelengths of a pass
geometry.py        parts, models and poses as a Mitsuba scene
beam_lamp.py       the beam-limited area light as a Mitsuba emitter
film_bands.py      the way without LLVM: Mitsuba's own integrator, four bands a pass, group by group
angle_sensor.py    its camera on a grid of angles
spots.py           lamps as spots of the same candela, for that way
spot_shares.py     how often each spot is looked for: as much as it lights what the camera sees
labels.py          one ray per tile centre: instance, category, depth, distance, normal
doctor.py          which variants work on this machine, and what to install
llvm.py            where LLVM is taken from: the system, or a copy beside this Python
conf/              presets
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .doctor import doctor_command
from .renderer import MitsubaRenderer


@hookimpl
def isethdr_components():
    return [Component("renderer", "mitsuba", MitsubaRenderer)]


@hookimpl
def isethdr_commands(app):
    app.command("doctor")(doctor_command)


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_mitsuba.conf"]
