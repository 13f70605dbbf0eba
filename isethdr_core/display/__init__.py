"""Display: how a linear picture or a rendering is looked at. Never a stage.

| module          | what                                                                 |
|-----------------|----------------------------------------------------------------------|
| `display_view`  | what a linear picture looks like on a display                        |
| `preview`       | scene radiance denoised light group by light group, for eyes only    |
| `tone_mapping`  | displayed luminance that depends on a pixel's surroundings           |
| `white_balance` | colours as seen by an eye that has adapted to the light of the scene |
"""
