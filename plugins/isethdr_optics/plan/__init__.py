"""Plan: what of a field and of a lens's effects is needed, decided once, then applied to light.

Uses imaging, field, psf and flare. Nothing but the lenses uses it.

| module            | content                                                                  |
|-------------------|--------------------------------------------------------------------------|
| `imaging_seconds` | what a lens expects to take for the light of a frame                     |
| `lens_plan`       | the plan of one lens and one field, applied to light                     |
| `outline`         | what a plan will need of a field, known before there is any light        |
| `planning`        | the decisions: region, kernels, wings and ghosts, with their error terms |
| `region`          | the bands and tiles of a field that go through the lens                  |
| `window`          | the tiles that a lens needs for sensors that see a part of the plane     |
"""
