"""Scene radiance by recipe: read stored radiance, and render only the missing part.

A recipe is the scene, the renderer and their code, without demand and weights. A renderer lists in
`effort_fields` the fields that change only the accuracy (for example `samples`): a store made with
at least the requested effort serves a run. A renderer with a method `enough(paths, noise)`
continues from stored radiance instead. Its stores are averaged (`sample_accumulation`), and the
renderer receives `{group: Known}` with the stored samples of each light group.

| module              | content                                                                 |
|---------------------|-------------------------------------------------------------------------|
| `recipe`            | the name of the radiance that a scene and a renderer describe together  |
| `stored_radiance`   | which stores serve a demand, and what is missing                        |
| `joined_radiance`   | the radiance of several stores as one Dataset, with its errors          |
| `render_request`    | what a renderer is asked for, or what other frames give instead         |
| `rendered_radiance` | checks of what a renderer returns                                       |
| `missing_radiance`  | render what is missing, and store it                                    |
| `radiance_of_run`   | the scene radiance of a run: stored, rendered, or made by the scene     |
"""

from .joined_radiance import opened, rounding_term
from .radiance_of_run import scene_radiance
from .recipe import recipe_hash
from .render_request import rendering_of
from .stored_radiance import held_and_missing, is_equal_stored, what_is_missing

__all__ = [
    "held_and_missing",
    "is_equal_stored",
    "opened",
    "recipe_hash",
    "rendering_of",
    "rounding_term",
    "scene_radiance",
    "what_is_missing",
]
