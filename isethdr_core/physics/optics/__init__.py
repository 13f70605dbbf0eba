"""Optics: pupils, wavefronts, diffraction, glasses, and exact and paraxial rays.

| module                | content                                                                 |
|-----------------------|-------------------------------------------------------------------------|
| `chord_transforms`    | transforms of the chords of a pupil along x, summed over rows of cells  |
| `defocus`             | blur of a point that is out of focus, and the hyperfocal distance       |
| `diffraction`         | the point spread function of any complex pupil                          |
| `distortion`          | maps between field coordinates and distorted coordinates                |
| `exact_tiles`         | light from tile to tile near the axis, from one sampled pattern         |
| `glass`               | refractive index of glasses, from published dispersion formulas         |
| `half_plane_pattern`  | the diffraction pattern of a pupil without phase, sampled once          |
| `lattice`             | the diffraction pattern of a pupil over a whole frame                   |
| `paraxial`            | paraxial matrices (height, angle) of any path through surfaces          |
| `pattern_columns`     | light from tile to tile in a few columns, from chords of the pupil      |
| `projection`          | field coordinates and the directions that they represent                |
| `pupil/`              | blades, dust and scratches of an aperture, averaged over cells          |
| `ray_sums`            | means of a scaling pattern over tiles and bands, along rays             |
| `ray_trace`           | exact rays through a list of surfaces                                   |
| `surfaces`            | surfaces of revolution: intersections with rays, and normals            |
| `thin_film`           | reflectance and transmittance of a stack of layers between two media    |
| `tile_weights`        | exact integrals of a band-limited function over tiles                   |
| `whole_plane_pattern` | the diffraction pattern of a pupil with phase, at few wavenumbers       |
| `zernike`             | wavefronts from OSA/ANSI Zernike coefficients                           |
"""
