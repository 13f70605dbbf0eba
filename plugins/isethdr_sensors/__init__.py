"""Image sensors: from irradiance to numbers, through the charge of every pixel.

| module           | what                                                                         |
|------------------|------------------------------------------------------------------------------|
| `bayer`          | one photodiode and one reading per pixel under red, green or blue filters    |
| `dual_gain`      | two readings of one charge, at high and at low conversion gain               |
| `ideal`          | the sensor that every other becomes when its effects are off                 |
| `imaging_sensor` | the fields and calls that all photodiode sensors share                       |
| `interleaved`    | two exposures or two sensitivities side by side in the filter array          |
| `limits`         | ranges of the fields of sensors                                              |
| `lin_log`        | a pixel that follows light linearly to a knee and logarithmically beyond     |
| `lofic`          | a photodiode that spills softly into a lateral overflow capacitor            |
| `one_reading`    | the fields of a sensor that reads one photodiode per pixel once              |
| `rgbw`           | a Bayer sensor with one green of each cell replaced by a clear filter        |
| `sensor_model`   | photodiodes that collect charge, readings that turn charge into numbers      |
| `single`         | one photodiode and one reading per pixel, under any colour filter array      |
| `split_pixel`    | a large and a small photodiode in every pixel                                |
| `staggered`      | several exposures of one photodiode, one after the other, read with one gain |
| `charge/`        | how a photodiode fills, overflows and shares with its neighbours             |
| `conf/`          | presets                                                                      |
| `noise/`         | of light, of charge, of reading, and what differs from pixel to pixel        |
| `readout/`       | one shot, from light through charge and converter to captures                |
| `sampling/`      | where the pixels lie, and how much light each photodiode collects            |
| `spectral/`      | filters, quantum efficiency, and the bands that a sensor asks for            |
| `timing/`        | when each row is exposed, and for how long                                   |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .bayer import BayerSensor
from .dual_gain import DualGainSensor
from .ideal import IdealSensor
from .interleaved import InterleavedSensor
from .lin_log import LinLogSensor
from .lofic import LoficSensor
from .rgbw import RgbwSensor
from .single import SingleSensor
from .split_pixel import SplitPixelSensor
from .staggered import StaggeredSensor


@hookimpl
def isethdr_components():
    return [
        Component("sensor", "ideal", IdealSensor),
        Component("sensor", "bayer", BayerSensor),
        Component("sensor", "rgbw", RgbwSensor),
        Component("sensor", "split_pixel", SplitPixelSensor),
        Component("sensor", "single", SingleSensor),
        Component("sensor", "dual_gain", DualGainSensor),
        Component("sensor", "staggered", StaggeredSensor),
        Component("sensor", "interleaved", InterleavedSensor),
        Component("sensor", "lofic", LoficSensor),
        Component("sensor", "lin_log", LinLogSensor),
    ]


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_sensors.conf"]
