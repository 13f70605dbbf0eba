"""Image signal processing: from captures in DN to a picture in cd/m2 with its variance.

| module               | content                                                              |
|----------------------|----------------------------------------------------------------------|
| `develop`            | from a mosaic of electrons to a picture in cd/m2                     |
| `development_fields` | the fields that every isp with a colour filter array shares          |
| `hdr_white`          | for display: blends nearly saturated pixels to white, as in ISETCam  |
| `ideal`              | the inverse of an ideal sensor                                       |
| `linear`             | one capture to a picture, by linear steps                            |
| `merge`              | all captures of one shot to one picture                              |
| `raw_file`           | one capture as a digital negative (DNG 1.4, a TIFF/EP)               |
| `scene_light`        | estimate of the light in which a shot was taken                      |
| `spectra`            | lights of a driving scene and smooth reflectances, all from formulas |
| `conf/`              | presets                                                              |
| `demosaic/`          | every channel at every pixel, and denoising before it                |
| `network/`           | a trained network from an ONNX file                                  |
| `readout/`           | from DN back to electrons, several captures into one                 |
"""

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

COMPONENTS = [
    Component("isp", "ideal", "isethdr_isp.ideal:IdealIsp"),
    Component("isp", "linear", "isethdr_isp.linear:LinearIsp"),
    Component("isp", "merge", "isethdr_isp.merge:MergeIsp"),
    Component("isp", "network", "isethdr_isp.network.isp:NetworkIsp"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components() -> list[Component]:
    """Return the image signal processors."""
    return COMPONENTS


@hookimpl
def isethdr_config_paths() -> list[str]:
    """Return the package of the presets, such as `isp=merge_isetcam`."""
    return ["pkg://isethdr_isp.conf"]
