"""Laws of physics, one per function, on plain arrays.

The package imports numpy, scipy, array-api-compat and, if it is installed, ducc0.

| module         | content                                                                     |
|----------------|-----------------------------------------------------------------------------|
| `area`         | public path of `physics.resampling.area`                                    |
| `arrays`       | arrays of other libraries than NumPy that have the Python array API         |
| `diffraction`  | public path of `physics.optics.diffraction`                                 |
| `modulation`   | public path of `physics.detector.temporal_modulation`                       |
| `noise`        | public path of `physics.detector.noise`                                     |
| `photometry`   | cd/m2, lux and CIE XYZ of a spectrum                                        |
| `random_words` | public path of `physics.detector.random_words`                              |
| `radiometry`   | photons per joule, widths of bands, irradiance of a lens from radiance      |
| `colour/`      | colour spaces and differences, and a basis for spectra                      |
| `convolution/` | linear (not circular) convolution with a bound on its error                 |
| `detector/`    | charge of a pixel, exact noise by inversion, and light that varies in time  |
| `optics/`      | pupils, wavefronts, diffraction, glasses, and exact and paraxial rays       |
| `resampling/`  | exact integrals of uniform tiles over other grids                           |
"""
