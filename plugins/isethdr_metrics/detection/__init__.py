"""Detection: whether contrasts and objects can be detected in a picture.

Several modules compute the probability of a pair: the probability that the measured contrast of two
pixels lies within an interval around their true contrast.

| module               | content                                                       |
|----------------------|---------------------------------------------------------------|
| `contrast_detection` | the metric: median probability of the pairs of each region    |
| `count_differences`  | probability that a difference of two noisy counts is above 0  |
| `count_sums`         | probability of a pair of counts with normal noise             |
| `expected_picture`   | mean and variance of each pixel over noise realisations       |
| `object_contrast`    | contrast of an object, such as a person, with its surround    |
| `pair_medians`       | medians of regions, exact only for the pairs that decide them |
| `pair_probability`   | probability of a pair from its means and variances            |
| `photon_counts`      | probability of pairs down to few electrons                    |
| `pixel_pairs`        | choice of the pairs of pixels                                 |
| `wedge`              | probability of a pair with normal noise                       |
"""
