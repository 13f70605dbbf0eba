"""Paper: the figures of the ISETHDR paper, computed again.

| module            | content                                                           |
|-------------------|-------------------------------------------------------------------|
| `fig1`            | light groups, night and day, objects and distances of one scene   |
| `fig2`            | area lights with beams of decreasing width, on a road             |
| `fig3`            | one rendering by day and by night, and a line through a headlight |
| `fig4`            | flare by blades and dirt; five lights, each ten times dimmer      |
| `fig5`            | exposure ladder of a phone camera at night                        |
| `fig6_7`          | split pixel in a tunnel and close to headlights                   |
| `fig8_9`          | RGB against RGBW from starlight to a lit room                     |
| `fig8_9_networks` | the same with networks, on roads that were not used for training  |
| `parameters`      | choice between the parameters of the paper and of its scripts     |
| `rendered_scene`  | common parts: a rendered scene, sheets of pictures                |
"""
