"""Uncertainty: stated errors, their share of a budget, and their effect on pixels and scores.

| module              | content                                                                    |
|---------------------|----------------------------------------------------------------------------|
| `budget`            | the error allowed, and how the stages share it                             |
| `changed_scenes`    | pictures of the scene with other renderer noise                            |
| `earlier_terms`     | error terms as stored by earlier versions, and stated by their plugins     |
| `error_terms`       | stated errors as data: source, quantity, part, value, unit, how known      |
| `ledger`            | seconds, peak memory, errors and what was left out, per stage              |
| `percentile_errors` | how far noise moves a percentile                                           |
| `propagation`       | stated errors as errors of the electrons of each capture                   |
| `reference_white`   | display white of the reference picture, and how renderer noise moves it    |
| `render_noise`      | the renderer's own noise, tile by tile, and in the pixels of a camera      |
| `score_errors`      | errors of scores due to the renderer's noise                               |
| `score_intervals`   | one 95 % interval per score, for sensor noise and renderer noise together  |
| `score_movements`   | how renderer noise moves a score, from its changes in changed pictures     |
| `spending`          | error shares that the components of a chain ask for, and get               |
"""
