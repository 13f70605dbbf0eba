"""Optics: pupils, wavefronts, diffraction, glasses, and exact and paraxial rays.

| module        | what                                                                    |
|---------------|-------------------------------------------------------------------------|
| `diffraction` | the point spread function of any complex pupil                          |
| `distortion`  | maps between field coordinates and distorted ones                       |
| `glass`       | refractive index against wavelength, from published dispersion formulas |
| `lattice`     | the diffraction pattern of a pupil over a whole frame                   |
| `paraxial`    | paraxial matrices (height, angle) of any path through surfaces          |
| `projection`  | how field coordinates stand for directions                              |
| `pupil`       | blades, dust and scratches of an aperture, averaged over cells          |
| `ray_trace`   | exact rays through a list of surfaces                                   |
| `surfaces`    | surfaces of revolution: where a ray meets them, and their normals       |
| `thin_film`   | what a stack of layers between two media reflects and transmits         |
| `zernike`     | wavefronts from OSA/ANSI Zernike coefficients                           |
"""
