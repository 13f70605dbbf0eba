"""Paper: the figures of the ISETHDR paper, computed again.

| module           | what                                                                         |
|------------------|------------------------------------------------------------------------------|
| `fig3`           | one rendering, two mixes of its light groups                                 |
| `fig4`           | blades across, dirt down, five lights that each step down by ten             |
| `fig5`           | road users come out of the dark and drown in the growing flare of headlights |
| `fig6_7`         | split pixel, three captures: in a tunnel                                     |
| `fig8_9`         | RGB against RGBW filters from starlight to a lit room                        |
| `rendered_scene` | a rendered scene with its lens and dirt, and sheets of labelled pictures     |
"""
