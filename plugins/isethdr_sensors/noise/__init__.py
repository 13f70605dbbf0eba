"""Noise of light, charge and reading, and differences between pixels.

| module             | content                                                                  |
|--------------------|--------------------------------------------------------------------------|
| `dark_current`     | thermal electrons, doubling every 8 K                                    |
| `fixed_pattern`    | differences between pixels that stay from shot to shot                   |
| `lin_log_variance` | the variance that is stated for a lin-log reading                        |
| `read_noise`       | one normal draw per pixel and reading, in electrons before the converter |
| `row_noise`        | one normal offset per row and reading, new in every shot                 |
| `shot_noise`       | the Poisson count of light and dark electrons                            |
| `telegraph_noise`  | traps that are filled or empty when a pixel is read                      |
"""
