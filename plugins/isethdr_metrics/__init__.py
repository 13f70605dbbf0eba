"""Metrics: numbers about a picture against its truth, for the whole frame and for every object.

| module         | what                                                                 |
|----------------|----------------------------------------------------------------------|
| `limits`       | ranges of the fields of metrics                                      |
| `pixel_shares` | shares of pixels that were measured and that are saturated           |
| `regions`      | the frame and the objects in it, and what every metric needs of them |
| `conf/`        | presets                                                              |
| `detection/`   | whether contrasts and objects can still be told                      |
| `luminance/`   | levels, dynamic range, noise, sharpness and flare                    |
| `similarity/`  | how alike a picture and its reference look                           |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .detection.contrast_detection import ContrastDetection
from .detection.object_contrast import ObjectContrast
from .luminance.dynamic_range import DynamicRange
from .luminance.line_profile import LineProfile
from .luminance.log_luminance_error import LogLuminanceError
from .luminance.mean_luminance import MeanLuminance
from .luminance.normalized_flare import NormalizedFlare
from .luminance.slanted_edge import SlantedEdgeResponse
from .luminance.snr_curve import SnrCurve
from .pixel_shares import PixelShares
from .similarity.ciede2000 import Cie76, Cie94, Ciede2000
from .similarity.ssim import Ssim
from .similarity.ssim_pu21 import SsimPu21


@hookimpl
def isethdr_components():
    """Return the metrics."""
    return [
        Component("metric", "ideal", MeanLuminance),
        Component("metric", "dynamic_range", DynamicRange),
        Component("metric", "snr_curve", SnrCurve),
        Component("metric", "ciede2000", Ciede2000),
        Component("metric", "cie94", Cie94),
        Component("metric", "cie76", Cie76),
        Component("metric", "ssim", Ssim),
        Component("metric", "log_luminance_error", LogLuminanceError),
        Component("metric", "line_profile", LineProfile),
        Component("metric", "object_contrast", ObjectContrast),
        Component("metric", "contrast_detection", ContrastDetection),
        Component("metric", "normalized_flare", NormalizedFlare),
        Component("metric", "slanted_edge", SlantedEdgeResponse),
        Component("metric", "ssim_pu21", SsimPu21),
        Component("metric", "pixel_shares", PixelShares),
    ]
