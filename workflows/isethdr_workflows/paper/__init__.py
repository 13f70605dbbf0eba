"""Paper: the figures of the ISETHDR paper, computed again.

| module           | content                                                           |
|------------------|-------------------------------------------------------------------|
| `fig3`           | one rendering by day and by night, and a line through a headlight |
| `fig4`           | flare by blades and dirt, five lights each dimmer by ten          |
| `fig5`           | exposure ladder of a phone camera at night                        |
| `fig6_7`         | split pixel in a tunnel and beside headlights                     |
| `fig8_9`         | RGB against RGBW from starlight to a lit room                     |
| `rendered_scene` | what the figures share: a rendered scene, sheets of pictures      |
"""
