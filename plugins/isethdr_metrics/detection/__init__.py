"""Detection: whether contrasts and objects can still be told.

| module               | what                                                                  |
|----------------------|-----------------------------------------------------------------------|
| `contrast_detection` | how likely it is that a contrast of the scene is still about the same |
| `object_contrast`    | does a person, a bicycle, a deer stand out from what is around it?    |
| `photon_counts`      | the probability that two noisy pixels show about their true contrast  |
"""
