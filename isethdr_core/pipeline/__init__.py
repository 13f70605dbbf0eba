"""Pipeline: the chain of stages, and what can be known of it before anything is computed.

| module             | what                                                              |
|--------------------|-------------------------------------------------------------------|
| `bands`            | outer bands that neither a sensor nor the truth sees              |
| `chain`            | scene -> renderer -> lighting -> lens -> sensor -> isp -> metrics |
| `demand`           | what is still needed, passed from the scores back to the scene    |
| `early_checks`     | mistakes that components see in each other before any work        |
| `field_check`      | whether the camera's field covers every sensor                    |
| `imaging_plan`     | how a lens makes the light of one field, decided once             |
| `memory`           | how much memory a run takes; refused where the machine has less   |
| `noise_limit`      | how much noise of the light the cameras let through unseen        |
| `overscan`         | whether tiles beyond the camera's field are needed                |
| `runtime_estimate` | how long each stage will take, from stored runs                   |
| `shot`             | what cameras look at, and what each makes of it                   |
| `window`           | the part of the image plane that sensors see                      |
"""
