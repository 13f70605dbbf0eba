"""The channelised Hotelling observer: what it reads of a window, and what it finds.

| module       | what                                                                       |
|--------------|----------------------------------------------------------------------------|
| `channels`   | Hermite-Gauss channels of an object's box                                  |
| `clutter`    | mean and covariance of the channels over windows without objects           |
| `counting`   | simulated decisions, to compare with the observer's probabilities          |
| `difference` | an object's window with the object less without it, filled from its ring   |
| `hotelling`  | detectability, share of objects found, bias of few windows                 |
| `observing`  | every object of the frames of one camera, by all of the above              |
"""
