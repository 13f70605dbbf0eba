"""Propagation: the stated errors of all stages as errors of the electrons of each capture, in units
of the sensor's own noise.

Propagation is linear. The renderer's noise is known tile by tile (`render_noise`); it is taken as
if the lens did not blur it. Errors of the stages after it are shares of the electrons they act on
(`error_terms`). In each pixel, bounds and measured errors are summed to b, and the squares of
statistical errors to the variance s^2. The error of the pixel is then b + |normal deviate of
standard deviation s|. A figure of a picture is the 99th percentile of the errors of its unsaturated
pixels (`within`). There are figures of the renderer, of all stages after it up to the sensor, of
the sensor, and of all together.

| module               | content                                                                 |
|----------------------|-------------------------------------------------------------------------|
| `captured_electrons` | the electrons of each capture, their noise, and the parts of the light  |
| `electron_rates`     | electrons per area and second at each pixel                             |
| `pixel_sample`       | a regular grid of pixels that stands for all                            |
| `pixel_errors`       | error terms of the stages, as errors of the electrons of each pixel     |
| `share_within`       | the limit that a share of errors does not exceed                        |
| `picture_figures`    | the error of a picture in units of its noise, as the ledger states it   |
"""

from .captured_electrons import (
    Electrons,
    Exposure,
    electrons,
    missing,
    with_parts,
)
from .electron_rates import (
    band_sum,
    light_plane,
)
from .picture_figures import (
    AFTER_RENDERER,
    RENDERER,
    SENSOR,
    WHOLE,
    Figures,
    Seconds,
    figures_of,
    record_figures,
    seconds,
)
from .pixel_errors import (
    UNIT,
    UNITS,
    after,
    stated_noise,
    terms_after,
    terms_of_sensor,
)
from .pixel_sample import (
    ENOUGH,
    regular_sample,
)
from .share_within import (
    SHARE,
    within,
)

__all__ = [
    "AFTER_RENDERER",
    "ENOUGH",
    "RENDERER",
    "SENSOR",
    "SHARE",
    "UNIT",
    "UNITS",
    "WHOLE",
    "Electrons",
    "Exposure",
    "Figures",
    "Seconds",
    "after",
    "band_sum",
    "electrons",
    "figures_of",
    "light_plane",
    "missing",
    "record_figures",
    "regular_sample",
    "seconds",
    "stated_noise",
    "terms_after",
    "terms_of_sensor",
    "with_parts",
    "within",
]
