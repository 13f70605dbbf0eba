"""Imaging: mixed radiance to irradiance or photocurrent on the sensor plane.

| module              | content                                                                    |
|---------------------|----------------------------------------------------------------------------|
| `accuracy_shares`   | shares of the allowed error for kernels, ghosts and convolution            |
| `array_backend`     | convolution by another array library than NumPy                            |
| `bright_tiles`      | light of bright tiles that a spectral fit misses, added band by band       |
| `field_optics`      | sensor plane, kernels and throughput of one field                          |
| `irradiance`        | mixed radiance to irradiance on the tiles of the field, band by band       |
| `kernel_memory`     | memory of the kernels of a frame, before they are computed                 |
| `kernel_statements` | error terms of the kernels of a field                                      |
| `overlap_add`       | the sum of many parts of an image, each convolved with its own kernel      |
| `photocurrent`      | mixed radiance directly to the electrons of a sensor's channels            |
| `photoelectron_map` | electrons that a sensor would collect from a scene without blur            |
| `sensor_plane`      | image positions of the tiles of a field, and their relative illumination   |
| `spectral_fit`      | the weighted sums of bands that are convolved for a sensor                 |
| `spread_errors`     | the effect of kernel errors on the light of each tile of a scene           |
| `threads`           | blocks of work on a pool of threads, and linear algebra on one thread      |
| `wing_truncation`   | kernels that end where the light beyond is too faint for any sensor        |
"""
