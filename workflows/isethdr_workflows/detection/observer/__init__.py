"""The channelised Hotelling observer: its input from a window, and the objects that it finds.

| module       | what                                                                       |
|--------------|----------------------------------------------------------------------------|
| `channels`   | Hermite-Gauss channels of an object's box                                  |
| `clutter`    | mean and covariance of the channels over windows without objects           |
| `counting`   | simulated decisions, to compare with the observer's probabilities          |
| `difference` | what an object adds to its window, compared with the filled background     |
| `hotelling`  | detectability, share of objects found, bias of few windows                 |
| `observing`  | every object of the frames of one camera, by the modules above             |
"""
