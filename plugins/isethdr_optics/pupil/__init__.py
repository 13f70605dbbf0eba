"""Pupil: stop, wavefront, apodization and flares of a lens, combined on any grid.

| module          | content                                                                |
|-----------------|------------------------------------------------------------------------|
| `apodization`   | light that does not fill the stop evenly                               |
| `pupil_map`     | map from points of the stop to points of the exit pupil                |
| `sampled_pupil` | stop, wavefront and flares of a lens, combined on any grid of cells    |
| `wavefronts`    | the wavefront of a lens at a wavelength                                |
"""
