"""Sequences: frames of a moving scene, with automatic exposure that settles over the frames.

| module             | content                                                                     |
|--------------------|-----------------------------------------------------------------------------|
| `command`          | the command `isethdr sequence`                                              |
| `request`          | the settings of a sequence, checked                                         |
| `frames`           | the config of each frame, and the runs of all frames                        |
| `runtime_estimate` | run time of all frames, before any work                                     |
| `table`            | exposure of each camera in each frame, printed and as CSV                   |
"""
