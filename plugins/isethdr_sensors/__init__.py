"""Image sensors: from irradiance to digital numbers (DN), through the charge of every pixel.

| module           | content                                                                      |
|------------------|------------------------------------------------------------------------------|
| `bayer`          | one photodiode and one reading per pixel under red, green or blue filters    |
| `dual_gain`      | two readings of one charge, at high and at low conversion gain               |
| `ideal`          | the sensor without any effect: the limit of all others                       |
| `imaging_sensor` | the fields and calls that all photodiode sensors share                       |
| `interleaved`    | two exposures or two sensitivities side by side in the filter array          |
| `limits`         | ranges of the fields of sensors                                              |
| `lin_log`        | a pixel that follows light linearly to a knee and logarithmically beyond     |
| `lofic`          | a photodiode that spills softly into a lateral overflow capacitor            |
| `one_reading`    | the fields of a sensor that reads one photodiode per pixel once              |
| `rgbw`           | a Bayer sensor with one green of each cell replaced by a clear filter        |
| `sensor_model`   | photodiodes that collect charge, readings that convert charge to DN          |
| `single`         | one photodiode and one reading per pixel, under any colour filter array      |
| `split_pixel`    | a large and a small photodiode in every pixel                                |
| `staggered`      | several exposures of one photodiode, one after the other, read with one gain |
| `charge/`        | how a photodiode fills, overflows and shares with its neighbours             |
| `conf/`          | presets                                                                      |
| `noise/`         | noise of light, charge and reading, and differences between pixels           |
| `readout/`       | one shot, from light through charge and converter to captures                |
| `sampling/`      | where the pixels lie, and how much light each photodiode collects            |
| `spectral/`      | filters, quantum efficiency, and the bands that a sensor needs               |
| `timing/`        | when each row is exposed, and for how long                                   |
"""

from isethdr_core.component import Component, class_getter
from isethdr_core.hookspecs import hookimpl

COMPONENTS = [
    Component("sensor", "ideal", "isethdr_sensors.ideal:IdealSensor"),
    Component("sensor", "bayer", "isethdr_sensors.bayer:BayerSensor"),
    Component("sensor", "rgbw", "isethdr_sensors.rgbw:RgbwSensor"),
    Component("sensor", "split_pixel", "isethdr_sensors.split_pixel:SplitPixelSensor"),
    Component("sensor", "single", "isethdr_sensors.single:SingleSensor"),
    Component("sensor", "dual_gain", "isethdr_sensors.dual_gain:DualGainSensor"),
    Component("sensor", "staggered", "isethdr_sensors.staggered:StaggeredSensor"),
    Component("sensor", "interleaved", "isethdr_sensors.interleaved:InterleavedSensor"),
    Component("sensor", "lofic", "isethdr_sensors.lofic:LoficSensor"),
    Component("sensor", "lin_log", "isethdr_sensors.lin_log:LinLogSensor"),
]
__getattr__ = class_getter(__name__, COMPONENTS)


@hookimpl
def isethdr_components() -> list[Component]:
    return COMPONENTS


@hookimpl
def isethdr_config_paths() -> list[str]:
    return ["pkg://isethdr_sensors.conf"]
