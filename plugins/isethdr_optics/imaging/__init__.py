"""Imaging: mixed radiance to irradiance or photocurrent on the sensor plane.

| module              | what                                                                       |
|---------------------|----------------------------------------------------------------------------|
| `array_backend`     | bands convolved by another array library than NumPy                        |
| `bright_tiles`      | what a spectral fit misses of their light, added around them band by band  |
| `irradiance`        | mixed radiance to irradiance on the sensor plane                           |
| `overlap_add`       | the sum of many parts of an image                                          |
| `photocurrent`      | mixed radiance straight to electrons per area and time in each channel of  |
| `photoelectron_map` | electrons that a sensor makes of a scene's light before it is spread       |
| `sensor_limited`    | kernels no wider, ghosts no fainter                                        |
| `sensor_plane`      | where a lens sends the tiles of a field, and how much of their light       |
| `spectral_fit`      | which functionals of a scene's spectra to convolve                         |
| `spread_errors`     | what the errors of kernels do to the light of one scene, tile by tile      |
| `threads`           | blocks of work on as many threads as are of use, and linear algebra on one |
| `window`            | what a lens takes of the field, and makes light of                         |
"""
