"""Noise: of light, of charge, of reading, and what differs from pixel to pixel.

| module             | what                                                                     |
|--------------------|--------------------------------------------------------------------------|
| `dark_current`     | thermal electrons, doubling every 8 K                                    |
| `fixed_pattern`    | what differs from pixel to pixel and stays from shot to shot             |
| `lin_log_variance` | the variance that a lin-log reading states of itself                     |
| `read_noise`       | one normal draw per pixel and reading, in electrons before the converter |
| `row_noise`        | one normal offset per row and reading, new in every shot                 |
| `shot_noise`       | the Poisson count of light and dark electrons                            |
| `telegraph_noise`  | traps that are filled or empty when a pixel is read                      |
"""
