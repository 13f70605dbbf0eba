"""Image sensors: from irradiance to numbers, through the charge of every pixel.

| file                  | what                                                                            |
|-----------------------|---------------------------------------------------------------------------------|
| `ideal`               | the sensor without effects                                                      |
| `bayer`, `rgbw`       | one capture, red, green, blue (and clear) filters                               |
| `split_pixel`         | three captures of a large and a small photodiode                                |
| `sensor_model`        | what a sensor is made of: photodiodes and readings                              |
| `shot`                | one shot in the order in which it happens                                       |
| `quantum_efficiency`  | electrons per photon; bands that do not matter                                  |
| `spectral_curves`     | fitted filter curves, blocking filter, a user's own curves from CSV             |
| `colour_filter_array` | filter patterns                                                                 |
| `pixel_grid`          | where the pixels lie in the camera's field                                      |
| `area_integration`    | light over the photodiode's area                                                |
| `dark_current`        | thermal electrons                                                               |
| `shot_noise`          | Poisson counts of charge                                                        |
| `full_well`           | the largest charge                                                              |
| `fixed_pattern`       | PRNU, dark spread, DSNU and columns of a device                                 |
| `read_noise`          | normal noise of a reading                                                       |
| `converter`           | conversion gain, analog gain, black level, bits                                 |
| `captures`            | the Dataset that leaves the sensor                                              |
| `isetcam_parity`      | ISETCam's rules, for comparison                                                 |
"""

from isethdr_core.component import Component
from isethdr_core.hookspecs import hookimpl

from .bayer import BayerSensor
from .ideal import IdealSensor
from .rgbw import RgbwSensor
from .split_pixel import SplitPixelSensor


@hookimpl
def isethdr_components():
    return [
        Component("sensor", "ideal", IdealSensor),
        Component("sensor", "bayer", BayerSensor),
        Component("sensor", "rgbw", RgbwSensor),
        Component("sensor", "split_pixel", SplitPixelSensor),
    ]


@hookimpl
def isethdr_config_paths():
    return ["pkg://isethdr_sensors.conf"]
