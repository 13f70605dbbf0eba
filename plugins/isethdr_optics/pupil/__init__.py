"""Pupil: stop, wavefront, apodization and flares of a lens put together on any grid.

| module          | what                                                                         |
|-----------------|------------------------------------------------------------------------------|
| `apodization`   | light that does not fill the stop evenly                                     |
| `band_phase`    | lenses and dust whose phase changes within a band by more than its parts can |
| `pupil_map`     | from places in the stop to places in the pupil that the image sees           |
| `sampled_pupil` | stop, wavefront and flares of a lens put together on any grid of cells       |
| `wavefronts`    | its own, its colour's and its focus's, as Zernike coefficients               |
"""
