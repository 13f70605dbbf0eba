"""Laws: one per function, on plain arrays, numpy and scipy only.

| module        | what                                                                        |
|---------------|-----------------------------------------------------------------------------|
| `radiometry`  | photons and joules, band widths, irradiance from radiance, falloff          |
| `colour`      | sRGB, CIELAB, colour differences, colour matrix of a sensor                 |
| `photometry`  | luminance, illuminance, CIE XYZ                                             |
| `diffraction` | point spread function of a pupil on a pixel-locked grid                     |
| `zernike`     | wavefront from OSA/ANSI coefficients                                        |
| `convolution` | linear convolution of scenes with twelve decades of light                   |
| `area`        | exact integration of constant tiles over other rectangles                   |
| `noise`       | pixel-keyed random words, exact Poisson and normal quantiles                |
"""
