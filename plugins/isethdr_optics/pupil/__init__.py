"""Pupil: stop, wavefront, apodization and flares of a lens, combined on any grid.

| module            | content                                                                    |
|-------------------|----------------------------------------------------------------------------|
| `apodization`     | light that does not fill the stop evenly                                   |
| `fine_cells`      | amplitude times phase, from cells that are fine enough for the wavefront   |
| `folded_pupil`    | a pupil with its wavefront, summed modulo a period                         |
| `pupil_cells`     | the mean amplitude of stop and flares over each cell of a grid             |
| `pupil_energy`    | the integral of the squared amplitude over a pupil                         |
| `pupil_grid`      | cells that cover a pupil, fine enough for its image and its wavefront      |
| `pupil_map`       | map from points of the stop to points of the exit pupil                    |
| `pupil_phase`     | whether a pupil has any phase, and how much it changes with the wavelength |
| `pupil_shapes`    | stop and flares of a lens as one sum of exact shapes                       |
| `pupil_size`      | radius, area and distance of a pupil, and the size of its pattern          |
| `wavefront_cells` | cells of a pupil, multiplied by the phase of the wavefront                 |
| `wavefronts`      | the wavefront of a lens at a wavelength                                    |
"""
