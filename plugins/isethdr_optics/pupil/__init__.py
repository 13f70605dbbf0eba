"""Pupil: stop, wavefront, apodization and flares of a lens put together on any grid.

| module          | content                                                                |
|-----------------|------------------------------------------------------------------------|
| `apodization`   | light that does not fill the stop evenly                               |
| `pupil_map`     | from places in the stop to places in the pupil that the image sees     |
| `sampled_pupil` | stop, wavefront and flares of a lens put together on any grid of cells |
| `wavefronts`    | the wavefront of a lens at a wavelength                                |
"""
