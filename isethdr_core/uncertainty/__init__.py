"""Uncertainty: stated errors, their share of a budget, and what they do to pixels and scores.

| module            | what                                                                       |
|-------------------|----------------------------------------------------------------------------|
| `budget`          | what a run may be wrong by, as a share of the sensor's noise               |
| `error_terms`     | what a stated error acts on, on which part of the light                    |
| `ledger`          | per stage the seconds, the peak memory, the error and what was left out    |
| `lens_errors`     | what a lens knows of how wrong its kernels make the light of one scene     |
| `propagation`     | every stage's stated error carried to the electrons of each capture        |
| `render_noise`    | what of a scene's light is the renderer's own noise, tile by tile          |
| `score_errors`    | how far the renderer's own noise moves the scores of a picture             |
| `score_intervals` | one 95 % interval per score, over sensor noise and renderer noise together |
"""
