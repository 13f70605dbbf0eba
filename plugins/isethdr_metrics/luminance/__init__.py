"""Luminance: levels, dynamic range, noise, sharpness and flare.

| module                | what                                                                 |
|-----------------------|----------------------------------------------------------------------|
| `dynamic_range`       | from the luminance that just shows to the brightest one measured     |
| `line_profile`        | luminance along one row, where flare shows best                      |
| `log_luminance_error` | how far a picture's luminance is from the truth, in decades          |
| `mean_luminance`      | the simplest score, and the one that shows an error of level at once |
| `noise_line`          | read noise and shot noise of a picture                               |
| `normalized_flare`    | how much light the camera puts where none should be                  |
| `slanted_edge`        | spatial frequency response after ISO 12233                           |
| `snr_curve`           | signal to noise ratio against luminance                              |
"""
