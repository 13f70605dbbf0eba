"""Chain: the components of one run, from its config to the scores of each camera.

    scene -> renderer -> lighting -> lens (+ flares) -> sensor -> isp -> metrics
      data flows to the right                        demands flow to the left

| module            | content                                                                   |
|-------------------|---------------------------------------------------------------------------|
| `components`      | `Chain`: the components of one run, and the settings that they share      |
| `from_config`     | build the chain of a composed config; refuse wrong names, keys and values |
| `checks`          | refuse combinations of components that cannot work, before any work       |
| `narrowing`       | smaller demands of a component, and the union of several demands          |
| `demand_of_run`   | the demand on the scene, derived backwards from the scores                |
| `side_by_side`    | independent parts of a run on several threads                             |
| `interrupts`      | Ctrl-C and SIGTERM end a stage, also where native code hides them         |
| `stages`          | run one stage: hooks around it, its row in the ledger, its kept result    |
| `imaging_stage`   | light on the sensor plane, by the plan of the lens                        |
| `camera`          | one camera of a run at work, and its results                              |
| `camera_stages`   | captures, picture, reference picture and scores of one camera, in order   |
| `camera_scores`   | scores, those of further noise realisations, and errors of renderer noise |
| `picture_error`   | the error of a picture in units of the sensor's noise                     |
"""

from .camera import Camera
from .camera_stages import camera_threads, through_camera, through_cameras
from .checks import check_motion
from .components import SHOWN, Chain
from .demand_of_run import frame_of, plan
from .from_config import chain, checked_config
from .imaging_stage import imaging, imaging_plan, on_sensor
from .narrowing import narrowed, union
from .stages import stage

__all__ = [
    "SHOWN",
    "Camera",
    "Chain",
    "camera_threads",
    "chain",
    "check_motion",
    "checked_config",
    "frame_of",
    "imaging",
    "imaging_plan",
    "narrowed",
    "on_sensor",
    "plan",
    "stage",
    "through_camera",
    "through_cameras",
    "union",
]
