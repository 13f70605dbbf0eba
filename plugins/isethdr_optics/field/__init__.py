"""Field: point spread functions and colours that change over the field.

| module             | what                                                                       |
|--------------------|----------------------------------------------------------------------------|
| `errors`           | what errors of kernels do to light where point spreads vary over the field |
| `field_point_lens` | a lens as it is for light from one place of the field, everywhere the same |
| `field_point_psf`  | kernels of a place of the field near their axis                            |
| `grid`             | where in the field the point spread is computed                            |
| `imaging`          | point spreads that vary over the field, scattered from the source          |
| `lateral_colour`   | an image whose size depends on wavelength                                  |
| `reference_bands`  | at which wavelengths the places of the field are chosen                    |
| `retiling`         | what moved tiles lose of their detail where they are shared among the      |
"""
