"""Image processing: training of the learned demosaic.

| module             | content                                              |
|--------------------|------------------------------------------------------|
| `dead_leaves`      | procedural pictures to learn from                    |
| `train_demosaic`   | filters of the learned demosaic, by ridge regression |
"""
