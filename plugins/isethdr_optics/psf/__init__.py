"""Point spread functions: how much of a tile's light reaches every other tile.

| module                      | what                                                              |
|-----------------------------|-------------------------------------------------------------------|
| `exact_core`                | a kernel near its axis, integrated over tiles and averaged over   |
| `interpolation_wavelengths` | wavelengths at which lattices of a pupil with phase are made      |
| `kernel_sampling_error`     | how wrong a kernel is beyond its exact core                       |
| `kernel_spectra`            | the transforms of a lens's kernels                                |
| `kernel_store`              | kernels and their transforms kept on disk between processes       |
| `kernels`                   | how much of a tile's light reaches every other tile               |
| `memory`                    | what point spread functions and kernels take                      |
| `scatter`                   | part of the light leaves the sharp image and is spread by angle   |
| `wing_truncation`           | light that is spread so far, and so thin, that no sensor can tell |
| `wings`                     | kernels beyond the exact core                                     |
"""
