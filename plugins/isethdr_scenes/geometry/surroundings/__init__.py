"""Surroundings: ground, road, tunnel, plants, houses and roadside furniture.

| module     | content                                                 |
|------------|---------------------------------------------------------|
| `ground`   | course of the road, and height of the land next to it   |
| `house`    | a gable house with windows, some of them lit            |
| `plants`   | trees, bushes and grass                                 |
| `road`     | the road, the land next to it, and places of grass      |
| `roadside` | guard rail, marker post and street lamp                 |
| `signs`    | road signs of retro-reflective sheeting                 |
| `tube`     | a road tunnel with its luminaires                       |
"""
