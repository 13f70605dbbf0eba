"""The study `learned_picture`: learned and classical pictures of held-out roads compared, by
illuminance.

| module        | content                                                                       |
|---------------|-------------------------------------------------------------------------------|
| `contest`     | shots of one camera at one illuminance, their scores, the colour matrix alone |
| `settings`    | classical settings, and the search for the best of them on training roads     |
| `road_scores` | stored scores of held-out roads in the folder of a model                      |
| `diagram`     | the work-precision diagram                                                    |
| `study`       | the study: paired differences with intervals over roads                       |
"""

from .study import learned_picture as learned_picture
