"""Laws: one per function, on plain arrays, libraries of numbers only: numpy, scipy, array-api-compat and, where installed, ducc0.

| module        | what                                                                        |
|---------------|-----------------------------------------------------------------------------|
| `radiometry`  | photons and joules, band widths, irradiance from radiance, falloff          |
| `colour`      | sRGB, CIELAB, colour differences, colour matrix of a sensor                 |
| `photometry`  | luminance, illuminance, CIE XYZ                                             |
| `diffraction` | point spread function of a pupil on a pixel-locked grid                     |
| `lattice`     | the same over whole frames, one point per step of a lattice                 |
| `pupil`       | iris, dust and scratches, averaged exactly over the cells of a grid         |
| `zernike`     | wavefront from OSA/ANSI coefficients                                        |
| `convolution` | linear convolution of scenes with twelve decades of light                   |
| `convolution_transform`, `convolution_direct` | its transforms in blocks; direct sums of what they may spoil |
| `arrays`      | arrays of other libraries, on a graphics processor say                      |
| `fourier`     | transforms along one axis, by the fastest library at hand                   |
| `convolution_spectral` | all bands at once, straight to the channels of a sensor           |
| `spectral_basis` | few numbers per spectrum that tell a sensor enough                      |
| `area`        | exact integration of constant tiles over other rectangles                   |
| `projection`  | tangents and angles as coordinates of a field: directions, solid angles     |
| `distortion`  | Brown-Conrady, Kannala-Brandt, tables: maps and exact inverses              |
| `overlap`     | areas that tiles seen through a distortion share with a regular grid        |
| `noise`       | exact Poisson and normal quantiles of random words                          |
| `random_words` | one 64-bit word per stream and pixel                                       |
| `charge_dynamics`, `charge_dynamics_noise`, `charge_dynamics_steps` | pixels that overflow: charge, its variance, integrators |
| `modulation`  | lamps that vary in time, integrated exactly over any exposure               |
| `modulation_pieces` | an exposure cut where lamps switch                                    |
| `thin_film`   | what stacks of layers reflect and transmit, at any angle and wavelength     |
| `glass`       | refractive index of optical glasses                                         |
| `surfaces`    | spheres, conics and aspheres: where rays meet them, normals                 |
| `ray_trace`   | exact rays along any path of refractions and reflections                    |
| `paraxial`    | matrices of such paths: focus, pupils, size of ghosts                       |
"""
