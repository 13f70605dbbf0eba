"""Image processing: merge rules, demosaic methods, and training of the learned demosaic.

| module             | what                                                 |
|--------------------|------------------------------------------------------|
| `dead_leaves`      | procedural pictures to learn from                    |
| `demosaic_methods` | demosaic methods compared on charts                  |
| `merge_rules`      | merge rules over eight decades of light              |
| `train_demosaic`   | filters of the learned demosaic, by ridge regression |
"""
