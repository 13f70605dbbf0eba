"""Readout: from DN to electrons, several captures merged to one mosaic, and the noise of both.

| module               | content                                                               |
|----------------------|-----------------------------------------------------------------------|
| `black_level`        | black level, stated or measured on optical black rows                 |
| `captures_check`     | check of variables, attributes and values that later steps need       |
| `combine`            | captures of one shot merged into one mosaic of electrons              |
| `defects`            | pixels of the sensor's map of defects, interpolated from neighbours   |
| `electrons`          | from DN to electrons with their variance, and the light per electron  |
| `fixed_pattern`      | differences between devices of the same model                         |
| `interleaved`        | one capture with two exposures or sensitivities in the filter array   |
| `merge_rules`        | published rules to merge a shot, for comparison                       |
| `noise_propagation`  | variance of a picture that is a linear map of the mosaic              |
| `nonlinear_response` | linearisation table of a nonlinear pixel                              |
| `shading`            | relative illumination, stated by the lens or measured on a flat field |
"""
