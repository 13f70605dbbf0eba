"""Field: point spread functions and colours that change over the field.

| module            | content                                                              |
|-------------------|----------------------------------------------------------------------|
| `core_reach`      | necessary reach of the cores of field points                         |
| `errors`          | effect of kernel errors if point spreads vary over the field         |
| `field_point_psf` | kernels of a field point near their axis                             |
| `field_work`      | work of kernels that vary over the field, before they are computed   |
| `grid`            | the field points where point spreads are computed, and their weights |
| `imaging`         | kernels of a lens with a point spread that varies over the field     |
| `kernels_of_field` | kernels of the axis, and one core for each field point              |
| `lateral_colour`  | an image with a size that depends on wavelength                      |
| `meridian`        | a lens at field points along +x of the field                         |
| `omissions`       | rows of the ledger for what a lens leaves out                        |
| `point_choice`    | the field points that are needed for the allowed error               |
| `reference_bands` | the wavelengths at which field points are chosen                     |
| `retiling`        | error of moving tiles to the grid of the sensor plane                |
"""
