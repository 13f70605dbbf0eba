"""Learned against classical pictures of held-out roads, by illuminance: the study
`learned_picture`.

| module        | content                                                                       |
|---------------|-------------------------------------------------------------------------------|
| `contest`     | shots of one camera at one illuminance, their scores, the colour matrix alone |
| `settings`    | classical settings, and the search for the best of them on training roads     |
| `road_scores` | scores of held-out roads beside a model, read again by figures                |
| `diagram`     | the work-precision diagram                                                    |
| `study`       | the study: paired differences with intervals over roads                       |
"""

from .study import learned_picture as learned_picture
