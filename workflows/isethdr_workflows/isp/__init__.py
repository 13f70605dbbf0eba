"""Image processing: merge rules, demosaic methods, and training of the learned demosaic.

| module             | what                                                                    |
|--------------------|-------------------------------------------------------------------------|
| `dead_leaves`      | pictures of overlapping shapes of every size, after Lee, Mumford        |
| `demosaic_methods` | PSNR and colour difference on charts and on a stripe pattern            |
| `merge_rules`      | merge rules compared over eight decades of light: signal to noise, bias |
| `train_demosaic`   | ridge regression of one linear filter per place of the array and local  |
"""
