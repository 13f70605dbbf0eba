"""Readout: from DN back to electrons, several captures into one, and the noise of both.

| module               | what                                                                  |
|----------------------|-----------------------------------------------------------------------|
| `black_level`        | black level, stated or measured on optical black rows                 |
| `combine`            | any number of captures of one shot into one mosaic of electrons       |
| `defects`            | pixels of the sensor's map of defects, taken from their neighbours    |
| `electrons`          | DN back to electrons with their variance, and their light             |
| `fixed_pattern`      | how far another device of the same model would differ                 |
| `interleaved`        | one capture in which some pixels of the filter array collect less     |
| `merge_rules`        | published rules to merge a shot, for comparison                       |
| `noise_propagation`  | the variance that a linear map of the mosaic leaves in the picture    |
| `nonlinear_response` | the linearisation table of a pixel that is not linear                 |
| `shading`            | relative illumination, stated by the lens or measured on a flat field |
"""
