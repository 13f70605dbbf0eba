"""Imaging: mixed radiance to irradiance or photocurrent on the sensor plane.

| module              | what                                                                       |
|---------------------|----------------------------------------------------------------------------|
| `array_backend`     | bands convolved by another array library than NumPy                        |
| `bright_tiles`      | what a spectral fit misses of their light, added around them band by band  |
| `irradiance`        | mixed radiance to irradiance on the sensor plane                           |
| `overlap_add`       | the sum of many parts of an image, each with a kernel of its own           |
| `photocurrent`      | mixed radiance straight to the electrons of a sensor's channels            |
| `photoelectron_map` | electrons that a sensor would make of the light before it is spread        |
| `sensor_limited`    | limits of wings, ghosts and field to what one sensor can measure           |
| `sensor_plane`      | where a lens sends the tiles of a field, and how much of their light       |
| `spectral_fit`      | the few functionals of spectra that a sensor needs convolved               |
| `spread_errors`     | what the errors of kernels do to the light of one scene, tile by tile      |
| `threads`           | blocks of work on as many threads as are of use, and linear algebra on one |
| `window`            | the tiles that a lens needs for sensors that see a part of the plane       |
"""
