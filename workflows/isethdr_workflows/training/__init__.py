"""Training of networks, `isethdr train`: on data of our own, from nothing, with a model card.

| module             | content                                                            |
|--------------------|--------------------------------------------------------------------|
| `card`             | model cards in YAML and Markdown                                   |
| `clock`            | length of a training over restarts, and its learning rate          |
| `command`          | the command line                                                   |
| `curves`           | losses against steps, as CSV and as a drawing                      |
| `files`            | files written as a whole or not at all                             |
| `onnx_notes`       | what an exporter notes of the machine is removed from model files  |
| `state`            | all that is needed to go on after a kill                           |
| `torch_library`    | PyTorch, imported in this place alone                              |
| `learned_picture/` | learned against classical pictures of held-out roads, a study      |
| `detector/`        | a small detector of road users, for `study detector_scores`        |
| `picture/`         | from raw captures to linear XYZ with a variance, for `isp=network` |
"""
