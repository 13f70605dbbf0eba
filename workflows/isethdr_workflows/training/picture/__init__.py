"""Learned development: raw captures to linear XYZ with a variance, `isethdr train picture`.

| module       | content                                                               | PyTorch |
|--------------|-----------------------------------------------------------------------|---------|
| `action`     | what the command does and prints                                      |         |
| `bank`       | noise-free pictures kept in the home, and random crops of them        |         |
| `camera`     | a sensor of a config, its planes of light, its shots as samples       |         |
| `export`     | the model file, checked against PyTorch                               | yes     |
| `finish`     | final weights, calibrated variance, card                              | yes     |
| `held_out`   | results by illuminance on held-out pictures, calibration              | yes     |
| `leaves`     | dead leaves as photocurrent and XYZ                                   |         |
| `linear_fit` | weights of the linear start in closed form                            | yes     |
| `loss`       | squared error in units of noise; a display's as an option             | yes     |
| `roads`      | rendered roads of a dataset as photocurrent and XYZ                   |         |
| `settings`   | settings of the command                                               |         |
| `sheets`     | patches side by side in one shot                                      |         |
| `sources`    | which pictures are trained on, and which are held out                 |         |
| `training`   | steps, checks, states                                                 | yes     |
| `networks/`  | U-Net, NAFNet, Restormer                                              | yes     |
"""
