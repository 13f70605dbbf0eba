"""Networks from raw planes to a picture, in PyTorch; imported only where a training runs.

| module            | content                                                              |
|-------------------|----------------------------------------------------------------------|
| `picture_network` | samples to XYZ and variance: square roots, a start, calibration      |
| `linear_start`    | the best linear estimate, by the level of signal over noise          |
| `u_shape`         | three resolutions with skips, of any block                           |
| `unet`            | block of plain 3 x 3 convolutions                                    |
| `nafnet`          | block of NAFNet: gates and channel attention                         |
| `restormer`       | block of Restormer: attention between channels                       |
| `choice`          | the networks by name and size                                        |
"""
