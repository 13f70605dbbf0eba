"""Plants and rocks, drawn from ranges.

| module         | content                                              |
|----------------|------------------------------------------------------|
| `bushes`       | bushes and hedges: leaves over an outline            |
| `foliage`      | leaves at three levels of detail, and fitting to size |
| `ground_cover` | patches of grass, and rocks                          |
| `trees`        | broadleaf trees and conifers through the seasons     |
"""
