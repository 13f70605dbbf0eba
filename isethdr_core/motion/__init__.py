"""Motion: what moves during a shot, between the rows of a sensor and between its captures.

A shot takes time: its captures follow each other, and so do the rows of a rolling shutter. The
scene is taken at several moments of the shot, the sub-frames. Each is the light of a window of
time, and a row of a capture collects the windows that its exposure overlaps. A scene that does not
move has no sub-frames, and its run is that of a still scene, bit for bit.

| module           | content                                                                       |
|------------------|-------------------------------------------------------------------------------|
| `settings`       | the table `motion` of a config, checked                                       |
| `shot_time`      | how long the shot of all cameras takes, and how large their pixels are        |
| `visible_motion` | by how far each tile moves during the shot, from labels and poses             |
| `moments`        | the windows of time of the sub-frames, as modulations of their light          |
| `sub_frames`     | the light of all sub-frames of one shot, rendered, mixed, and stated          |
| `run_time`       | how many sub-frames a run will have, and which of them are to be rendered     |
"""
