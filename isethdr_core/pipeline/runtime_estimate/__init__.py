"""Run time estimate: the time of each stage, from the ledgers of stored runs.

The estimate is the time of the same stage in the most similar stored run, times the ratio of the
sizes. Up to the lens, the size is the number of tiles. From the sensor on, it is the memory of the
pixels. Two times do not grow with the size and are not multiplied: that of the plan, and that of
loading libraries in the first stage that needs them, which is most of the time of a tiny run. The
time of a stored stage is at most its CPU time: the rest was waiting for other programs. Records of
earlier versions hold no CPU time; they are used only for stages that have no other record. A stage
without a stored run gets no estimate.

A lens may estimate its own time (`EstimatesImaging`): this estimate is corrected by the ratio of
measured to estimated time in stored runs. A renderer may estimate its time, too
(`EstimatesRendering`): the estimate is corrected by the stored rendering of the most similar size,
of any scene. Both are sums of measured constants, and are divided by the speed of this processor
(`relative_speed`). Sub-frames of a shot that moves are made and imaged one by one.

| file             | content                                                         |
|------------------|-----------------------------------------------------------------|
| `expected_times` | the expected seconds of every stage of a run                    |
| `stages`         | the names of the stages that a run will have                    |
| `records`        | stored runs, and the record that is most similar to a stage     |
| `work`           | the work of a stage relative to that in a stored run            |
| `rendering`      | the work of a rendering relative to that of a stored scene      |
| `machine_speed`  | speed of this processor, for estimates from measured constants  |
"""

from .expected_times import IMAGING, elapsed_s, expected_s, imaging_s
from .machine_speed import relative_speed
from .records import LOADING_S, OTHER_SETTINGS, newest
from .stages import stages
from .work import PIXELS, pixel_bytes, size

__all__ = [
    "IMAGING",
    "LOADING_S",
    "OTHER_SETTINGS",
    "PIXELS",
    "elapsed_s",
    "expected_s",
    "imaging_s",
    "newest",
    "pixel_bytes",
    "relative_speed",
    "size",
    "stages",
]
