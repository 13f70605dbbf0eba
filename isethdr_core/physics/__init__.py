"""Laws: one per function, on plain arrays; numpy, scipy, array-api-compat and, where installed,
ducc0.

| module         | content                                                                     |
|----------------|-----------------------------------------------------------------------------|
| `area`         | public path of `physics.resampling.area`                                    |
| `arrays`       | arrays of other libraries than NumPy, those with the Python array API       |
| `diffraction`  | public path of `physics.optics.diffraction`                                 |
| `modulation`   | public path of `physics.detector.temporal_modulation`                       |
| `noise`        | public path of `physics.detector.noise`                                     |
| `photometry`   | what a spectrum is in cd/m2, lux and CIE XYZ                                |
| `random_words` | public path of `physics.detector.random_words`                              |
| `radiometry`   | photons and joules, bands, and the irradiance that a lens makes of radiance |
| `colour/`      | colour spaces and differences, and a basis for spectra                      |
| `convolution/` | linear, never circular, with a bound on its error                           |
| `detector/`    | charge of a pixel, exact noise by inversion, and light that varies in time  |
| `optics/`      | pupils, wavefronts, diffraction, glasses, and exact and paraxial rays       |
| `resampling/`  | exact integrals of constant tiles over other grids                          |
"""
