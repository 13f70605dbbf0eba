"""Metrics: numbers about a picture against its truth, for the whole frame and for every object.

| module                | what                                                                      |
|-----------------------|---------------------------------------------------------------------------|
| `pixel_shares`        | shares of valid and of saturated pixels                                   |
| `mean_luminance`      | ideal: mean luminance, in cd/m2                                           |
| `dynamic_range`       | largest valid luminance over the smallest seen, in three definitions      |
| `snr_curve`           | SNR against luminance                                                     |
| `contrast_detection`  | probability that a contrast of the scene is measured as such (IEEE 2020)  |
| `normalized_flare`    | light where none should be, over the brightest source                     |
| `slanted_edge`        | spatial frequency response (ISO 12233)                                    |
| `ciede2000`           | colour differences: CIEDE2000, CIE 94, CIE 76                             |
| `ssim`                | structural similarity of the two displayed pictures                       |
| `ssim_pu21`           | structural similarity of the two luminances as an eye sees them           |
| `log_luminance_error` | rms of the difference of log10 luminance                                  |
| `line_profile`        | log luminance along one row                                               |
| `object_contrast`     | Weber contrast of each object against its surround, and its SNR           |
| `photon_counts`       | probability that two pixels of few electrons show their true contrast     |
| `noise_line`          | read noise and shot noise from the variance of a picture                  |
| `similarity`          | the map that both kinds of structural similarity are means of             |
| `limits`              | ranges of the fields                                                      |
| `regions`             | which pixels belong to what, and intervals by resampling blocks           |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .ciede2000 import Cie76, Cie94, Ciede2000
from .contrast_detection import ContrastDetection
from .dynamic_range import DynamicRange
from .line_profile import LineProfile
from .log_luminance_error import LogLuminanceError
from .mean_luminance import MeanLuminance
from .normalized_flare import NormalizedFlare
from .object_contrast import ObjectContrast
from .pixel_shares import PixelShares
from .slanted_edge import SlantedEdgeResponse
from .snr_curve import SnrCurve
from .ssim import Ssim
from .ssim_pu21 import SsimPu21


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
