"""Scenes: procedural driving scenes, test charts, and scenes stored by others.

| file | holds |
|---|---|
| night_drive, tunnel | the components: a country road, and a tunnel with a bright exit |
| placement, placement_tunnel | who stands where |
| builders | from places to models and a description |
| limits, validation | ranges of fields; checks of several fields together |
| materials, lamps, lamp_spectra | spectral reflectances; lamps in candela; their spectra |
| measured_spectra | tables of colour-science, kept on disk after their first use |
| geometry | meshes computed from parameters |
| charts | test charts whose radiance is known |
| iset_exr | scenes rendered by others |
| iset_exr_files | the files of such a scene: EXR and MAT |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from . import charts, iset_exr
from .night_drive import NightDrive
from .tunnel import Tunnel


@hookimpl
def isethdr_components():
    """Return the scenes."""
    own = [("night_drive", NightDrive), ("tunnel", Tunnel)]
    return [
        Component("scene", name, cls)
        for name, cls in (*own, *charts.COMPONENTS, *iset_exr.COMPONENTS)
    ]


@hookimpl
def isethdr_config_paths():
    """Return the presets' folder."""
    return ["pkg://isethdr_scenes.conf"]
