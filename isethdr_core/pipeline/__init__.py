"""Pipeline: the chain of stages, and what can be known of it before anything is computed.

| module             | what                                                                     |
|--------------------|--------------------------------------------------------------------------|
| `bands`            | outer ones that neither a sensor nor the truth sees                      |
| `chain`            | scene -> renderer -> lighting -> lens -> sensor -> isp -> metrics        |
| `demand`           | what is still needed, passed from the scores back to the scene before    |
| `early_checks`     | mistakes in a configuration that components can see in each other before |
| `field_check`      | whether the camera's field covers every sensor                           |
| `memory`           | what a run will hold, refused while it is planned where the machine has  |
| `overscan`         | tiles beyond the camera's field                                          |
| `runtime_estimate` | how long each stage of a run will take                                   |
| `window`           | what sensors see of the image plane                                      |
"""
