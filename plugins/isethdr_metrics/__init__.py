"""Metrics: scores of a picture against its reference picture, for the frame and every object.

| module         | content                                                        |
|----------------|----------------------------------------------------------------|
| `limits`       | ranges of the fields of metrics                                |
| `pixel_shares` | shares of valid and of saturated pixels                        |
| `regions`      | the frame and the objects in it; means and intervals over them |
| `conf/`        | presets                                                        |
| `detection/`   | whether contrasts and objects can be detected                  |
| `luminance/`   | levels, dynamic range, noise, sharpness and flare              |
| `similarity/`  | similarity of a picture and its reference picture              |
"""

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

COMPONENTS = [
    Component("metric", "ideal", "isethdr_metrics.luminance.mean_luminance:MeanLuminance"),
    Component("metric", "dynamic_range", "isethdr_metrics.luminance.dynamic_range:DynamicRange"),
    Component("metric", "snr_curve", "isethdr_metrics.luminance.snr_curve:SnrCurve"),
    Component("metric", "ciede2000", "isethdr_metrics.similarity.ciede2000:Ciede2000"),
    Component("metric", "cie94", "isethdr_metrics.similarity.ciede2000:Cie94"),
    Component("metric", "cie76", "isethdr_metrics.similarity.ciede2000:Cie76"),
    Component("metric", "ssim", "isethdr_metrics.similarity.ssim:Ssim"),
    Component(
        "metric",
        "log_luminance_error",
        "isethdr_metrics.luminance.log_luminance_error:LogLuminanceError",
    ),
    Component("metric", "line_profile", "isethdr_metrics.luminance.line_profile:LineProfile"),
    Component(
        "metric", "object_contrast", "isethdr_metrics.detection.object_contrast:ObjectContrast"
    ),
    Component(
        "metric",
        "contrast_detection",
        "isethdr_metrics.detection.contrast_detection:ContrastDetection",
    ),
    Component(
        "metric", "normalized_flare", "isethdr_metrics.luminance.normalized_flare:NormalizedFlare"
    ),
    Component(
        "metric", "slanted_edge", "isethdr_metrics.luminance.slanted_edge:SlantedEdgeResponse"
    ),
    Component("metric", "ssim_pu21", "isethdr_metrics.similarity.ssim_pu21:SsimPu21"),
    Component("metric", "pixel_shares", "isethdr_metrics.pixel_shares:PixelShares"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components() -> list[Component]:
    """Return the metrics."""
    return COMPONENTS
