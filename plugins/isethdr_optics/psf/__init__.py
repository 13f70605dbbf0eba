"""Point spread functions: how much of a tile's light reaches every other tile.

| module                      | content                                                          |
|-----------------------------|------------------------------------------------------------------|
| `band_phase`                | phase that changes too much within a band                        |
| `error_parts`               | parts of the light and keys that errors of the lens share        |
| `exact_core`                | a kernel near its axis, integrated over tiles and bands          |
| `interpolation_wavelengths` | wavelengths at which patterns of a pupil with phase are made     |
| `kernel_sampling_error`     | how wrong a kernel is beyond its exact core                      |
| `kernel_spectra`            | the transforms of a lens's kernels, kept                         |
| `kernel_store`              | kernels and their transforms kept on disk between processes      |
| `kernel_work`               | the CPU seconds that kernels from patterns take                  |
| `kernels`                   | how much of a tile's light reaches every other tile              |
| `memory`                    | the memory that kernels take; refused where the machine has less |
| `phase_patterns`            | kernels of all bands of a lens with a wavefront                  |
| `scaled_pattern`            | kernels of all bands of a pupil without phase                    |
| `scatter`                   | energy-conserving scatter mixed into a kernel                    |
| `wings`                     | kernels beyond the exact core, from lattices of the pattern      |
"""
