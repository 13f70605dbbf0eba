"""Metrics: numbers about a picture against its truth, for the whole frame and for every object.

| module                | what                                                                      |
|-----------------------|---------------------------------------------------------------------------|
| `mean_luminance`      | ideal: mean luminance, in cd/m2                                           |
| `dynamic_range`       | largest valid luminance over the one where SNR = 1                        |
| `snr_curve`           | SNR against luminance                                                     |
| `ciede2000`           | colour difference                                                         |
| `ssim`                | structural similarity of the two displayed pictures                       |
| `log_luminance_error` | rms of the difference of log10 luminance                                  |
| `line_profile`        | log luminance along one row                                               |
| `object_contrast`     | Weber contrast of each object against its surround, and its SNR           |
| `regions`             | which pixels belong to what, and intervals by resampling blocks           |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .ciede2000 import Ciede2000
from .dynamic_range import DynamicRange
from .line_profile import LineProfile
from .log_luminance_error import LogLuminanceError
from .mean_luminance import MeanLuminance
from .object_contrast import ObjectContrast
from .snr_curve import SnrCurve
from .ssim import Ssim


@hookimpl
def isethdr_components():
    """Return the metrics."""
    return [Component("metric", "ideal", MeanLuminance), Component("metric", "dynamic_range", DynamicRange),
            Component("metric", "snr_curve", SnrCurve), Component("metric", "ciede2000", Ciede2000),
            Component("metric", "ssim", Ssim), Component("metric", "log_luminance_error", LogLuminanceError),
            Component("metric", "line_profile", LineProfile), Component("metric", "object_contrast", ObjectContrast)]
