"""Training of networks, `isethdr train`: on simulated data, from random weights, with a model card.

| module             | content                                                            |
|--------------------|--------------------------------------------------------------------|
| `card`             | model cards in YAML and Markdown                                   |
| `clock`            | length of a training over restarts, and its learning rate          |
| `command`          | the command line                                                   |
| `curves`           | losses against steps, as CSV and as a drawing                      |
| `files`            | files that are written completely or not at all                    |
| `interrupts`       | Ctrl-C, which takes effect between two steps                       |
| `onnx_notes`       | removes notes of the exporter about the machine from model files   |
| `state`            | the state from which an interrupted training continues             |
| `torch_library`    | the only place that imports PyTorch                                |
| `learned_picture/` | a study of learned and classical pictures on held-out roads        |
| `detector/`        | a small detector of road users, for `study detector_scores`        |
| `picture/`         | from raw captures to linear XYZ with a variance, for `isp=network` |
"""
