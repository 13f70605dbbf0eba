"""Learned development: raw captures to linear XYZ with a variance, `isethdr train picture`.

| module       | content                                                               | PyTorch |
|--------------|-----------------------------------------------------------------------|---------|
| `action`     | the action of the command, and its output                             |         |
| `bank`       | stored noise-free pictures, and random crops of them                  |         |
| `camera`     | a sensor of a config, its planes of light, its shots as samples       |         |
| `export`     | the model file, checked against PyTorch                               | yes     |
| `finish`     | final weights, calibrated variance, card                              | yes     |
| `held_out`   | results by illuminance on held-out pictures, calibration              | yes     |
| `leaves`     | dead leaves as photocurrent and XYZ                                   |         |
| `linear_fit` | weights of the linear start in closed form                            | yes     |
| `loss`       | squared error in units of noise, or error of displayed values         | yes     |
| `roads`      | rendered roads of a dataset as photocurrent and XYZ                   |         |
| `settings`   | settings of the command                                               |         |
| `sheets`     | patches side by side in one shot                                      |         |
| `sources`    | pictures for training, and held-out pictures                          |         |
| `training`   | steps, checks, states                                                 | yes     |
| `networks/`  | U-Net, NAFNet, Restormer                                              | yes     |
"""
