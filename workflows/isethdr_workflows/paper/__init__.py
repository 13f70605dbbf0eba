"""Paper: the figures of the ISETHDR paper, computed again.

| module            | content                                                           |
|-------------------|-------------------------------------------------------------------|
| `fig1`            | light groups, night and day, objects and distances of one scene   |
| `fig2`            | area lights with narrower and narrower beams, on a road           |
| `fig3`            | one rendering by day and by night, and a line through a headlight |
| `fig4`            | flare by blades and dirt, five lights each dimmer by ten          |
| `fig5`            | exposure ladder of a phone camera at night                        |
| `fig6_7`          | split pixel in a tunnel and beside headlights                     |
| `fig8_9`          | RGB against RGBW from starlight to a lit room                     |
| `fig8_9_networks` | the same with networks, on roads that they have not seen          |
| `parameters`      | where the paper and its scripts differ                            |
| `rendered_scene`  | what the figures share: a rendered scene, sheets of pictures      |
"""
