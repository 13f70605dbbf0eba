"""Display: views of a linear picture or a rendering. These modules are never part of a stage.

| module          | content                                                              |
|-----------------|----------------------------------------------------------------------|
| `display_view`  | a linear picture as a display would show it                          |
| `preview`       | scene radiance denoised group by group, for views only               |
| `tone_mapping`  | displayed luminance that depends on a pixel's surroundings           |
| `white_balance` | colours as seen by an eye that has adapted to the light of the scene |
"""
