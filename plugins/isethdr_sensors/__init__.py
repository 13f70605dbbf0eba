"""Image sensors: from irradiance to numbers, through the charge of every pixel.

| file                  | what                                                                            |
|-----------------------|---------------------------------------------------------------------------------|
| `ideal`               | the sensor without effects                                                      |
| `one_reading`         | the fields of `single` and `lin_log`                                            |
| `single`              | one capture under any filter array                                              |
| `bayer`, `rgbw`       | `single` with red, green, blue (and clear) filters                              |
| `interleaved`         | `single` with two exposures or sensitivities side by side                       |
| `staggered`           | several exposures of one photodiode                                             |
| `dual_gain`           | two readings of one charge                                                      |
| `split_pixel`         | three or four captures of a large and a small photodiode                        |
| `lofic`               | a photodiode that spills into a capacitor, read without and with it             |
| `lin_log`             | one capture, linear to a knee and logarithmic beyond                            |
| `lin_log_response`    | the table that reads it back                                                    |
| `lin_log_variance`    | the variance that a reading states of itself                                    |
| `soft_knee`           | the fields of a photodiode that overflows exponentially                         |
| `soft_knee_shot`      | one shot of these pixels                                                        |
| `soft_knee_in_time`   | their charge under light that varies during the exposure                        |
| `limits`              | ranges of the fields                                                            |
| `imaging_sensor`      | the fields that these share                                                     |
| `auto_exposure`       | the exposure at which the metered level meets its target                        |
| `sensor_model`        | what a sensor is made of: photodiodes and readings                              |
| `shot`                | one shot in the order in which it happens                                       |
| `band_integration`    | means of spectral curves over the bands of the light                            |
| `quantum_efficiency`  | electrons per photon; bands that do not matter                                  |
| `response`            | what is asked of a lens that answers in photocurrent                            |
| `spectral_curves`     | fitted filter curves, blocking filter, a user's own curves from CSV             |
| `colour_filter_array` | filter patterns                                                                 |
| `exposure_timing`     | when each row is exposed, and how much of light that varies falls into it       |
| `pixel_grid`          | where the pixels lie in the camera's field                                      |
| `area_integration`    | light over the photodiode's area                                                |
| `crosstalk`           | light and electrons that a neighbour collects                                   |
| `interleave`          | dark charge of pixels that expose for a shorter time                            |
| `dark_current`        | thermal electrons                                                               |
| `shot_noise`          | Poisson counts of charge                                                        |
| `full_well`           | the largest charge                                                              |
| `blooming`            | charge beyond the well, along the column                                        |
| `fixed_pattern`       | PRNU, dark spread, hot pixels, DSNU, columns and rows of a device               |
| `read_noise`          | normal noise of a reading, and its noisier pixels                               |
| `row_noise`           | noise that the pixels of a row share                                            |
| `converter`           | conversion gain, analog gain, black level, bits, non-linearity                  |
| `companding`          | piecewise linear squeeze of codes, and the table that undoes it                 |
| `captures`            | the Dataset that leaves the sensor                                              |
| `isetcam_parity`      | ISETCam's rules, for comparison                                                 |
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
