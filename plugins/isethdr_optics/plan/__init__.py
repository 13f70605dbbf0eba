"""Plan: the decision which parts of a field and effects of a lens are needed, and the imaging of
light by it.

The package uses imaging, field, psf and flare. Only the lenses use it.

| module            | content                                                                  |
|-------------------|--------------------------------------------------------------------------|
| `behind_glass`    | a lens behind drops or a film, which change the light first              |
| `depth_layers`    | the light of a lens focused at one distance, by the depth of every tile  |
| `imaging_seconds` | run time estimate of a lens for one frame                                |
| `lens_plan`       | the plan of one lens and one field, applied to light                     |
| `outline`         | the facts of a plan that are certain before the light is known           |
| `planning`        | the decisions: region, kernels, wings and ghosts, with their error terms |
| `region`          | the bands and tiles of a field that are imaged                           |
| `window`          | the tiles that are needed for sensors that see a part of the image plane |
"""
