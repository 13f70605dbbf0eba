"""Imaging: mixed radiance to irradiance or photocurrent on the sensor plane.

| module              | content                                                                    |
|---------------------|----------------------------------------------------------------------------|
| `accuracy_shares`   | how a lens divides the error allowed over what it spends it on             |
| `array_backend`     | bands convolved by another array library than NumPy                        |
| `bright_tiles`      | what a spectral fit misses of their light, added around them band by band  |
| `field_optics`      | sensor plane, kernels and throughput of one field                          |
| `irradiance`        | mixed radiance to irradiance on the tiles of the field, band by band       |
| `kernel_memory`     | the memory that the kernels of a frame take, known beforehand              |
| `kernel_statements` | error terms of the kernels of a field                                      |
| `overlap_add`       | the sum of many parts of an image, each with a kernel of its own           |
| `photocurrent`      | mixed radiance straight to the electrons of a sensor's channels            |
| `photoelectron_map` | electrons that a sensor would make of the light before it is spread        |
| `sensor_plane`      | where a lens sends the tiles of a field, and how much of their light       |
| `spectral_fit`      | the few functionals of spectra that a sensor needs convolved               |
| `spread_errors`     | what the errors of kernels do to the light of one scene, tile by tile      |
| `threads`           | blocks of work on as many threads as are of use, and linear algebra on one |
| `wing_truncation`   | where a kernel ends because no sensor can tell                             |
"""
