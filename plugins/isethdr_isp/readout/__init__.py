"""Readout: from DN back to electrons, several captures into one, and the noise of both.

| module               | what                                                                    |
|----------------------|-------------------------------------------------------------------------|
| `combine`            | any number of captures of one shot into one mosaic of electrons         |
| `electrons`          | from DN back to electrons with their variance                           |
| `fixed_pattern`      | how far the samples of another device of the same model would differ    |
| `interleaved`        | one capture in which some pixels of the filter array collect less       |
| `merge_rules`        | other people's ways to merge a shot, under one signature                |
| `noise_propagation`  | the variance that a linear map of the mosaic leaves in the picture      |
| `nonlinear_response` | the table by which a capture of a pixel that is not linear is read back |
| `shading`            | relative illumination, stated by the lens or measured on a flat field   |
"""
