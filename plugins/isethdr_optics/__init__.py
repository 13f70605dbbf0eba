"""Lenses and flare: from mixed radiance to irradiance on the sensor plane.

lens.py       the lenses `ideal`, `diffraction_limited`, `wavefront`: fields, energy, point spread function
flare.py      the flares `ideal` and `aperture`, and what a flare of your own may offer
imaging.py    radiance to irradiance: falloff, convolution of every band, added light, the ledger
kernels.py    tile-to-tile kernels of whole bands over the full frame, cached in the process
far.py        kernels beyond the exact core: averages of points of the diffraction pattern
pupils.py     lens, wavefront and flares put together into one sampled pupil
scatter.py    energy-conserving scatter mixed into a kernel
isetcam_parity.py  ISETCam's circular optical image, for comparison only
conf/         presets
"""

from __future__ import annotations

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .flare import ApertureFlare, IdealFlare
from .lens import DiffractionLimitedLens, IdealLens, WavefrontLens


@hookimpl
def isethdr_components():
    """Return the bundled lenses and flares."""
    return [
        Component("lens", "ideal", IdealLens),
        Component("lens", "diffraction_limited", DiffractionLimitedLens),
        Component("lens", "wavefront", WavefrontLens),
        Component("flare", "ideal", IdealFlare),
        Component("flare", "aperture", ApertureFlare),
    ]


@hookimpl
def isethdr_config_paths():
    """Return where the presets are."""
    return ["pkg://isethdr_optics.conf"]
