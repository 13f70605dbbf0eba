"""Detector: charge of a pixel, exact noise by inversion, and light that varies in time.

| module                  | content                                                             |
|-------------------------|---------------------------------------------------------------------|
| `charge_dynamics`       | dQ/dt = current(t) - overflow(Q), exact, for any light              |
| `charge_dynamics_noise` | mean, variance and covariance of a charge with soft overflow        |
| `charge_dynamics_steps` | stepwise integration of dQ/dt = light(t) - leak Q - overflow(Q)     |
| `exposure_pieces`       | an exposure, divided at the times when lamps switch                 |
| `noise`                 | normal and exact Poisson numbers by inversion of one random word    |
| `random_words`          | one 64-bit random word per stream and pixel                         |
| `temporal_modulation`   | exact light of any exposure under modulated lamps                   |
"""
