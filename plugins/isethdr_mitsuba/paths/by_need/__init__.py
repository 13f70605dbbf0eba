"""Adaptive sampling: more paths in the tiles and light groups whose noise cameras can see.

| module           | content                                                             |
|------------------|---------------------------------------------------------------------|
| `fireflies`      | tiles that further paths show to be far too bright                  |
| `moved_light`    | light that goes from single tiles to the tiles around them          |
| `plan`           | the fewest paths that bring every tile below its limit              |
| `mean_of_rounds` | mean light of the rounds, with weights that do not follow its paths |
| `rare_light`     | light of rare bright paths that one buffer does not have            |
| `rounds`         | first paths of all tiles, then rounds of paths as planned           |
| `tallies`        | sums and variances of the paths of each tile                        |
"""
