"""Readout: from DN back to electrons, several captures into one, and the noise of both.

| module               | content                                                               |
|----------------------|-----------------------------------------------------------------------|
| `black_level`        | black level, stated or measured on optical black rows                 |
| `captures_check`     | variables, attributes and values that later steps rely on             |
| `combine`            | captures of one shot merged into one mosaic of electrons              |
| `defects`            | pixels of the sensor's map of defects, taken from their neighbours    |
| `electrons`          | DN back to electrons with their variance, and their light             |
| `fixed_pattern`      | how far another device of the same model would differ                 |
| `interleaved`        | one capture with two exposures or sensitivities in the filter array   |
| `merge_rules`        | published rules to merge a shot, for comparison                       |
| `noise_propagation`  | variance of a picture that is a linear map of the mosaic              |
| `nonlinear_response` | linearisation table of a nonlinear pixel                              |
| `shading`            | relative illumination, stated by the lens or measured on a flat field |
"""
