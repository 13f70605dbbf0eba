"""Surroundings: ground, road, tunnel, plants, houses and roadside furniture.

| module     | content                                                 |
|------------|---------------------------------------------------------|
| `ground`   | where the road runs, and how high the land is beside it |
| `house`    | a gable house with windows, some of them lit            |
| `plants`   | trees, bushes and grass                                 |
| `road`     | the road and the land beside it; where grass grows      |
| `roadside` | guard rail, marker post and street lamp                 |
| `signs`    | road signs of retro-reflective sheeting                 |
| `tube`     | a road tunnel with its luminaires                       |
"""
