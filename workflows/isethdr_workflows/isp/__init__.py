"""Image processing: training of the learned demosaic.

| module             | content                                              |
|--------------------|------------------------------------------------------|
| `dead_leaves`      | procedural training pictures                         |
| `train_demosaic`   | filters of the learned demosaic, by ridge regression |
"""
