"""Pipeline: the chain of stages, and everything that is decided before the first computation.

| module             | content                                                           |
|--------------------|-------------------------------------------------------------------|
| `bands`            | outer bands that no sensor and no reference picture needs         |
| `chain`            | the components of one run, from its config to its scores          |
| `demand`           | the data still needed, passed from the scores back to the scene   |
| `early_checks`     | mistakes in combinations of components, found before any work     |
| `field_check`      | whether the camera's field covers every sensor                    |
| `imaging_plan`     | how a lens computes the light of one field, decided once          |
| `memory`           | memory of a run, which is refused if the machine has less         |
| `memory_estimate`  | peak memory of a run, as stated and as stored runs took           |
| `noise_limit`      | noise of the light that stays below the noise of the cameras      |
| `overscan`         | whether tiles beyond the camera's field are needed                |
| `runtime_estimate` | run time of each stage, from stored runs                          |
| `shot`             | the light on all cameras, and the results of each camera          |
| `window`           | the part of the image plane that sensors cover                    |
"""
