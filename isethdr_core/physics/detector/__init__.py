"""Detector: charge of a pixel, exact noise by inversion, and light that varies in time.

| module                  | what                                                                |
|-------------------------|---------------------------------------------------------------------|
| `charge_dynamics`       | dQ/dt = current(t) - overflow(Q), exact, for any light              |
| `charge_dynamics_noise` | mean, variance and covariance with what spilled, closed             |
| `charge_dynamics_steps` | step by step integration of dQ/dt = light(t) - leak Q - overflow(Q) |
| `exposure_pieces`       | an exposure cut where lamps switch                                  |
| `noise`                 | one random word per pixel becomes a standard normal or an exact     |
| `random_words`          | one 64-bit word per (stream, row, column)                           |
| `temporal_modulation`   | exact light of any exposure                                         |
"""
