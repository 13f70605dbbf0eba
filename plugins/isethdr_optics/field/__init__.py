"""Field: point spread functions and colours that change over the field.

| module            | content                                                              |
|-------------------|----------------------------------------------------------------------|
| `errors`          | what errors of kernels do where point spreads vary over the field    |
| `field_point_psf` | kernels of a field point near their axis                             |
| `grid`            | the field points where point spreads are computed, and their weights |
| `imaging`         | images through point spreads that vary over the field                |
| `lateral_colour`  | an image whose size depends on wavelength                            |
| `omissions`       | what a lens leaves out, stated in the plan and at work               |
| `reference_bands` | the wavelengths that choose the field points                         |
| `retiling`        | detail that moved tiles lose on the grid of the sensor plane         |
"""
