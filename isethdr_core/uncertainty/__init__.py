"""Uncertainty: stated errors, their share of a budget, and what they do to pixels and scores.

| module            | content                                                                    |
|-------------------|----------------------------------------------------------------------------|
| `budget`          | the error allowed, and how the stages share it                             |
| `changed_scenes`  | pictures of the scene with other renderer noise                            |
| `earlier_terms`   | error terms as stored by earlier versions, and stated by their plugins     |
| `error_terms`     | stated errors as data: source, quantity, part, value, unit, how known      |
| `ledger`          | seconds, peak memory, errors and what was left out, per stage              |
| `propagation`     | stated errors carried to the electrons of each capture                     |
| `render_noise`    | the renderer's own noise, tile by tile, and in the pixels of a camera      |
| `score_errors`    | how far the renderer's noise moves the scores                              |
| `spending`        | what the components of a chain spend the error allowed on                  |
| `score_intervals` | one 95 % interval per score, over sensor noise and renderer noise together |
"""
