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
| `charge_dynamics`, `charge_dynamics_noise`, `charge_dynamics_steps` | pixels that overflow: charge, its variance, integrators |
| `modulation`  | lamps that vary in time, integrated exactly over any exposure               |
| `thin_film`   | what stacks of layers reflect and transmit, at any angle and wavelength     |
| `glass`       | refractive index of optical glasses                                         |
| `surfaces`    | spheres, conics and aspheres: where rays meet them, normals                 |
| `ray_trace`   | exact rays along any path of refractions and reflections                    |
| `paraxial`    | matrices of such paths: focus, pupils, size of ghosts                       |
"""
