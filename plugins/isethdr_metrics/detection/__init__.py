"""Detection: whether contrasts and objects can still be told.

| module               | content                                                       |
|----------------------|---------------------------------------------------------------|
| `contrast_detection` | probability that a contrast of the scene shows in the picture |
| `count_differences`  | whether a difference of two counts with noise is above 0      |
| `count_sums`         | that probability for two counts with normal noise             |
| `expected_picture`   | mean and variance of each pixel, apart from one realisation   |
| `object_contrast`    | whether a person, bicycle or deer stands out                  |
| `pair_medians`       | median probability of regions, worked out where it decides    |
| `pair_probability`   | probability of one pair of pixels                             |
| `photon_counts`      | that probability at few electrons, by counting                |
| `pixel_pairs`        | the pairs of pixels whose contrast is looked for              |
| `wedge`              | that probability for normal noise                             |
"""
