"""Scenes: procedural driving scenes, test charts, and scenes stored by others.

| file | holds |
|---|---|
| night_drive, tunnel | the components: a country road, and a tunnel with a bright exit |
| street, street_models, street_detail | a street: the component, its meshes, their detail |
| placing | objects on and beside a road, placed before any mesh is made |
| traffic | motion of a street over time: drivers, junctions, pedestrians |
| placement, placement_tunnel | positions of all objects |
| builders | from positions to models and a scene description |
| limits, validation | ranges of fields; checks of several fields together |
| materials, lamps, lamp_spectra | spectral reflectances; lamps in candela; their spectra |
| coloured | materials of a stated colour, for asset packs |
| living_spectra | reflectances of cloth, hair, fur, leaves, bark and stone |
| dipped_beam | candela of a dipped beam over two angles |
| measured_spectra | tables of colour-science, kept on disk after their first use |
| road_surfaces | asphalt from dry to wet, and markings, fitted to r-tables |
| textures | surfaces that vary between two spectra |
| variation | materials that differ from object to object, and dust |
| retro_reflectors | sheeting, reflectors and animal eyes |
| road_photometry | Q0, S1, S2 and R_L of any surface |
| geometry | meshes computed from parameters |
| contact_sheets | small pictures of things, and the command `isethdr things` |
| things | families of vehicles, people, animals and plants, drawn from ranges |
| photometry | families of lamps, files of measured ones, limits of regulations |
| roads | networks of roads as OpenDRIVE describes them, and poses of things on them |
| scenario | places of the entities at the start of an OpenSCENARIO file |
| sky | day, twilight and night by direction, with sun and moon |
| charts | test charts whose radiance is known |
| stored | radiance from the home folder, selected by the name of its store |
| iset_exr | scenes of the published ISETHDR deposit |
| pictures | the user's own pictures and spectral cubes, from files and arrays |
| iset_import | import of all scenes of the deposit's folder tree into the home folder |
| iset_exr_files | the files of such a scene: EXR and MAT |
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

from .contact_sheets.command import things_app
from .iset_import.command import import_command
from .photometry.command import lamp_command
from .roads.pictures.command import roads_command

if TYPE_CHECKING:
    import typer


COMPONENTS = [
    Component("scene", "night_drive", "isethdr_scenes.night_drive:NightDrive"),
    Component("scene", "tunnel", "isethdr_scenes.tunnel:Tunnel"),
    Component("scene", "street", "isethdr_scenes.street:Street"),
    Component("scene", "uniform", "isethdr_scenes.charts.uniform:Uniform"),
    Component("scene", "ideal", "isethdr_scenes.charts.uniform:Uniform"),
    Component("scene", "macbeth", "isethdr_scenes.charts.macbeth:Macbeth"),
    Component("scene", "slanted_edge", "isethdr_scenes.charts.slanted_edge:SlantedEdge"),
    Component("scene", "point_lights", "isethdr_scenes.charts.point_lights:PointLights"),
    Component("scene", "moving_target", "isethdr_scenes.charts.moving_target:MovingTarget"),
    Component("scene", "luminance_ramp", "isethdr_scenes.charts.luminance_ramp:LuminanceRamp"),
    Component("scene", "file", "isethdr_scenes.pictures.picture_file:PictureFile"),
    Component("scene", "array", "isethdr_scenes.pictures.picture_file:PictureFile"),
    Component("scene", "stored", "isethdr_scenes.stored:Stored"),
    Component("scene", "iset_exr", "isethdr_scenes.iset_exr:IsetExr"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components() -> list[Component]:
    """Return the scene components."""
    return COMPONENTS


@hookimpl
def isethdr_commands(app: typer.Typer) -> None:
    """Add `isethdr lamp`, `isethdr import-iset`, `isethdr things` and `isethdr roads`."""
    app.command("lamp")(lamp_command)
    app.command("import-iset")(import_command)
    app.add_typer(things_app, name="things")
    app.add_typer(roads_command, name="roads")


@hookimpl
def isethdr_config_paths() -> list[str]:
    """Return the folder of the presets."""
    return ["pkg://isethdr_scenes.conf"]
