"""Field: point spread functions and colours that change over the field.

| module            | content                                                              |
|-------------------|----------------------------------------------------------------------|
| `errors`          | effect of kernel errors if point spreads vary over the field         |
| `field_point_psf` | kernels of a field point near their axis                             |
| `field_work`      | work of kernels that vary over the field, before they are computed   |
| `grid`            | the field points where point spreads are computed, and their weights |
| `imaging`         | images through point spreads that vary over the field                |
| `lateral_colour`  | an image whose size depends on wavelength                            |
| `omissions`       | rows of the ledger for what a lens leaves out                        |
| `reference_bands` | the wavelengths at which field points are chosen                     |
| `retiling`        | error of moving tiles to the grid of the sensor plane                |
"""
