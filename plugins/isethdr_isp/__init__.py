"""Image signal processing: from captures in DN to a picture in cd/m2 with its variance.

| module             | what                                                                  |
|--------------------|-----------------------------------------------------------------------|
| `ideal`            | every pixel for itself, for sensors without a filter array            |
| `linear`           | one capture                                                           |
| `merge`            | all captures of a shot                                                |
| `readout`          | DN to electrons, their variance, electrons per unit of light          |
| `bent_response`    | the table of a pixel that is not linear                               |
| `combine`          | captures to one mosaic of electrons, without bias                     |
| `rules`            | other people's rules for the same, by name                            |
| `hdr_white`        | what is nearly saturated blended to white: a view, for parity         |
| `demosaic`         | every channel at every pixel, any filter array                        |
| `demosaic_methods` | other ways to demosaic, by name                                       |
| `learned`          | one of them: filters learned per local class                          |
| `local_classes`    | which class every pixel belongs to                                    |
| `propagation`      | what the noise of samples becomes through linear kernels              |
| `fixed_pattern`    | how far another device of the model would differ: PRNU, dark, offsets |
| `interleaved`      | two exposures in one filter array, merged with the interpolation      |
| `denoise`          | non-local means of the mosaic                                          |
| `raw_file`         | one capture as a digital negative (DNG)                               |
| `shading`          | relative illumination, stated by the lens or measured                 |
| `development`      | the fields that all of these share                                    |
| `develop`          | colour matrix, lens falloff, absolute level                           |
| `spectra`          | lights and reflectances the colour matrix is solved for               |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .ideal import IdealIsp
from .linear import LinearIsp
from .merge import MergeIsp


@hookimpl
def isethdr_components():
    """Return the image signal processors."""
    return [
        Component("isp", "ideal", IdealIsp),
        Component("isp", "linear", LinearIsp),
        Component("isp", "merge", MergeIsp),
    ]


@hookimpl
def isethdr_config_paths():
    """Return the presets: `isp=merge_isetcam`."""
    return ["pkg://isethdr_isp.conf"]
