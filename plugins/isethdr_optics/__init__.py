"""Lenses and flare: from mixed radiance to irradiance on the sensor plane.

| module          | what                                                                       |
|-----------------|----------------------------------------------------------------------------|
| `conf/`         | presets                                                                    |
| `field/`        | point spread functions and colours that change over the field              |
| `flare/`        | dirty apertures, haze and ghosts                                           |
| `imaging/`      | mixed radiance to irradiance or photocurrent on the sensor plane           |
| `lenses/`       | the components, their fields and their ranges                              |
| `prescription/` | a real lens from its surfaces, glasses, coatings and stop                  |
| `psf/`          | how much of a tile's light reaches every other tile                        |
| `pupil/`        | stop, wavefront, apodization and flares of a lens put together on any grid |
"""

from __future__ import annotations

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .flare.aperture import ApertureFlare, IdealFlare
from .flare.ghosts.ghost_flare import GhostFlare
from .flare.haze import HazeFlare
from .lenses.prescription_lens import PrescribedLens
from .lenses.thin_lens import DiffractionLimitedLens, IdealLens, WavefrontLens


@hookimpl
def isethdr_components():
    """Return the bundled lenses and flares."""
    return [
        Component("lens", "ideal", IdealLens),
        Component("lens", "diffraction_limited", DiffractionLimitedLens),
        Component("lens", "wavefront", WavefrontLens),
        Component("lens", "prescription", PrescribedLens),
        Component("flare", "ideal", IdealFlare),
        Component("flare", "aperture", ApertureFlare),
        Component("flare", "haze", HazeFlare),
        Component("flare", "ghosts", GhostFlare),
    ]


@hookimpl
def isethdr_config_paths():
    """Return where the presets are."""
    return ["pkg://isethdr_optics.conf"]
