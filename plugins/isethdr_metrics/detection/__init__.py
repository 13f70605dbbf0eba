"""Detection: whether contrasts and objects can still be told.

| module               | content                                                       |
|----------------------|---------------------------------------------------------------|
| `contrast_detection` | probability that a contrast of the scene shows in the picture |
| `count_differences`  | whether a difference of two counts with noise is above 0      |
| `count_sums`         | that probability for two counts with normal noise             |
| `object_contrast`    | whether a person, bicycle or deer stands out                  |
| `photon_counts`      | that probability at few electrons, by counting                |
| `wedge`              | that probability for normal noise                             |
"""
