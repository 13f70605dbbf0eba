"""Point spread functions (PSF). A kernel is the share of a tile's light that reaches every other
tile.

| module                      | content                                                          |
|-----------------------------|------------------------------------------------------------------|
| `band_phase`                | error of a phase that changes too much within a band             |
| `error_parts`               | names of parts of the light, and keys, in errors of the lens     |
| `exact_core`                | a kernel near its axis, integrated over tiles and bands          |
| `interpolation_wavelengths` | wavelengths at which patterns of a pupil with phase are computed |
| `kernel_request`            | the bands, the lens and the grid of kernels that are asked for   |
| `kernel_sampling_error`     | error of a kernel beyond its exact core                          |
| `kernel_spectra`            | Fourier transforms of a lens's kernels                           |
| `kernel_store`              | kernels and their transforms on disk, shared by processes        |
| `kernel_work`               | run time estimate of kernels from patterns                       |
| `kernels/`                  | kernels of all bands of a lens, cached                           |
| `memory`                    | memory of kernels; an error if they need more than there is      |
| `phase_patterns`            | kernels of all bands of a lens with a wavefront                  |
| `point_spread`              | point spread functions for users, at single wavelengths          |
| `scaled_pattern/`           | kernels of all bands of a pupil without phase                    |
| `scatter`                   | energy-conserving scatter mixed into a kernel                    |
| `wings`                     | kernels beyond the exact core, from lattices of the pattern      |
"""
