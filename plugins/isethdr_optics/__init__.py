"""Lenses and flare: from mixed radiance to irradiance on the sensor plane.

lens.py       the lenses `ideal`, `diffraction_limited`, `wavefront`: fields, energy, point spread function
flare.py      the flares `ideal` and `aperture`, and what a flare of your own may offer
haze.py       the flare `haze`: a veil by Harvey-Shack or ABg scatter
imaging.py    radiance to irradiance: falloff, convolution of every band, added light, the ledger
kernels.py    tile-to-tile kernels of whole bands over the full frame, cached in the process
exact_core.py     and their middle, kept while they are made again
kernel_errors.py  how wrong they are
spread_errors.py  and what that does to the light of a scene
field_errors.py   and where point spreads vary over the field, or colours are magnified
kernel_spectra.py  their transforms
kernel_store.py  and both on disk, shared by processes
counted.py    what a sensor counts of a scene's light before it is spread
elsewhere.py  bands convolved by another array library, on a graphics processor say
photocurrent.py  radiance straight to the electrons of a sensor's channels
for_sensor.py    photocurrent with no more than a sensor can tell:
tails.py         kernels that end where it cannot
ghosts_seen.py   without ghosts that it cannot
window.py        and without tiles beside it whose light cannot reach it
spectral_fit.py  the functionals of a scene's spectra that this takes
bright_tiles.py  and what they miss of bright tiles
retiling.py       detail that is lost where moved tiles are shared among those of the sensor plane
field_imaging.py  point spreads that vary over the field, scattered from the source
overlaid.py       sums of convolved parts of one image
place_lens.py     a lens as one place of the field sees it
field_grid.py     the places of the field where they are computed, and their weights
reference_bands.py  at which wavelengths they are chosen, whatever bands a run asks for
place_cores.py    kernels of places, for many bands from transforms at a few wavelengths
far.py        kernels beyond the exact core: tile means of lattices of the diffraction pattern, drawn out over the band
band_phase.py     phase that changes within a band by more than they can follow
knots.py      wavelengths at which lattices of pupils with phase are made, a few for all bands
memory.py     arrays that the machine cannot hold, refused
pupils.py     lens, wavefront and flares put together into one sampled pupil
pupil_map.py  from places in the stop to places in the pupil that the image sees
wavefronts.py  the wavefront of a lens at a wavelength
uneven.py     light that does not fill the stop evenly
scatter.py    energy-conserving scatter mixed into a kernel
isetcam_parity.py  ISETCam's circular optical image, for comparison only
ghosts.py     the flare `ghosts`: light reflected twice between surfaces of a lens prescription
ghosts_trace.py           its pairs ranked by matrices, and real rays
ghosts_draw.py            its sources, and rays laid down on the sensor
prescription.py           lens prescriptions read from YAML (in prescriptions/), scaled and stopped down
prescription_coatings.py  coatings by name, what every surface reflects
prescription_figures.py   distortion, relative illumination, irradiance and f-number of a prescription from exact rays
prescription_rays.py      rays of one field point over its stop
prescription_exit_pupil.py  its stop as the image sees it, in direction cosines: an ellipse off the axis
prescription_wavefront.py  wavefronts over its field from exact optical paths
prescription_amplitude.py  light uneven over its exit pupil
prescription_rims.py      rims that cut its exit pupil off the axis
prescription_field.py     whether its beam gets to the corners of the camera's field
prescribed_lens.py        the lens `prescription`
limits.py                 ranges of the fields of lenses and flares
threads.py                blocks of work on several threads
sensor_plane.py           where a lens sends the tiles of a field: relative illumination, light moved along a distortion
lateral_colour.py         image size by wavelength, band by band on the sensor plane
omissions.py              what a lens spares, said in the plan and at work
conf/         presets
"""

from __future__ import annotations

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .flare import ApertureFlare, IdealFlare
from .ghosts import GhostFlare
from .haze import HazeFlare
from .lens import DiffractionLimitedLens, IdealLens, WavefrontLens
from .prescribed_lens import PrescribedLens


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
