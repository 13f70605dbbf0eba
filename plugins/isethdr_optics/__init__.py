"""Lenses and flare: from mixed radiance to irradiance on the sensor plane.

| module          | content                                                                    |
|-----------------|----------------------------------------------------------------------------|
| `abilities`     | Protocols by which lenses and flares of this package use each other        |
| `conf/`         | presets                                                                    |
| `field/`        | point spread functions and colours that change over the field              |
| `flare/`        | dirty apertures, haze, windscreen and ghosts                               |
| `imaging/`      | mixed radiance to irradiance or photocurrent on the sensor plane           |
| `lens_files/`   | lens files of other programs as prescriptions                              |
| `lenses/`       | the components, their fields and their ranges                              |
| `measured/`     | lenses from tables of point spread functions or MTF                        |
| `plan/`         | decides what can be left out of a field, and applies this to light         |
| `prescription/` | a real lens from its surfaces, glasses, coatings and stop                  |
| `psf/`          | kernels: the share of a tile's light that reaches every other tile         |
| `pupil/`        | stop, wavefront, apodization and flares of a lens, combined on any grid    |
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

from .lens_files.command import lens_app

if TYPE_CHECKING:
    import typer


COMPONENTS = [
    Component("lens", "ideal", "isethdr_optics.lenses.thin_lens:IdealLens"),
    Component(
        "lens", "diffraction_limited", "isethdr_optics.lenses.thin_lens:DiffractionLimitedLens"
    ),
    Component("lens", "wavefront", "isethdr_optics.lenses.wavefront_lens:WavefrontLens"),
    Component("lens", "prescription", "isethdr_optics.lenses.prescription_lens:PrescribedLens"),
    Component("lens", "measured", "isethdr_optics.lenses.measured_lens:MeasuredLens"),
    Component("flare", "ideal", "isethdr_optics.flare.aperture:IdealFlare"),
    Component("flare", "aperture", "isethdr_optics.flare.aperture:ApertureFlare"),
    Component("flare", "haze", "isethdr_optics.flare.haze:HazeFlare"),
    Component("flare", "drops", "isethdr_optics.flare.drops:DropsFlare"),
    Component("flare", "film", "isethdr_optics.flare.film:FilmFlare"),
    Component("flare", "windscreen", "isethdr_optics.flare.windscreen:WindscreenFlare"),
    Component("flare", "ghosts", "isethdr_optics.flare.ghosts.ghost_flare:GhostFlare"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components() -> list[Component]:
    """Return the bundled lenses and flares."""
    return COMPONENTS


@hookimpl
def isethdr_commands(app: typer.Typer) -> None:
    """Add `isethdr lens`."""
    app.add_typer(lens_app, name="lens")


@hookimpl
def isethdr_config_paths() -> list[str]:
    """Return the location of the presets."""
    return ["pkg://isethdr_optics.conf"]
