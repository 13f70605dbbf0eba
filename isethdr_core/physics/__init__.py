"""Laws: one per function, on plain arrays, numpy and scipy only.

| module        | what                                                                        |
|---------------|-----------------------------------------------------------------------------|
| `radiometry`  | photons and joules, band widths, irradiance from radiance, falloff          |
| `colour`      | sRGB, CIELAB, colour differences, colour matrix of a sensor                 |
| `photometry`  | luminance, illuminance, CIE XYZ                                             |
| `diffraction` | point spread function of a pupil on a pixel-locked grid                     |
| `pupil`       | iris, dust and scratches, averaged exactly over the cells of a grid         |
| `zernike`     | wavefront from OSA/ANSI coefficients                                        |
| `convolution` | linear convolution of scenes with twelve decades of light                   |
| `area`        | exact integration of constant tiles over other rectangles                   |
| `noise`       | exact Poisson and normal quantiles of random words                          |
| `random_words` | one 64-bit word per stream and pixel                                       |
"""
