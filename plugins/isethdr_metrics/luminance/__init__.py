"""Luminance: levels, dynamic range, noise, sharpness and flare.

| module                | content                                                            |
|-----------------------|--------------------------------------------------------------------|
| `dynamic_range`       | from the lowest detectable luminance to the brightest one measured |
| `line_profile`        | luminance along one row, which shows flare                         |
| `log_luminance_error` | difference of luminance from the reference picture, in decades     |
| `mean_luminance`      | the simplest score, which shows an error of the level              |
| `noise_line`          | read noise and shot noise of a picture                             |
| `normalized_flare`    | stray light away from the sources                                  |
| `slanted_edge`        | spatial frequency response after ISO 12233                         |
| `snr_curve`           | signal-to-noise ratio over luminance                               |
"""
