"""Networks from raw planes to a picture, in PyTorch. They are imported only for a training.

| module            | content                                                              |
|-------------------|----------------------------------------------------------------------|
| `picture_network` | from samples to XYZ and variance, by square roots; its calibration   |
| `linear_start`    | the best linear estimate for each level of signal over noise         |
| `u_shape`         | three resolutions with skip connections, of any block                |
| `unet`            | block of plain 3 x 3 convolutions                                    |
| `nafnet`          | block of NAFNet: gates and channel attention                         |
| `restormer`       | block of Restormer: attention between channels                       |
| `choice`          | the networks by name and size                                        |
"""
