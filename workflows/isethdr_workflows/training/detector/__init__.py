"""Training of a small detector for all cameras from random weights, `isethdr train detector`.

| module      | content                                                                      |
|-------------|------------------------------------------------------------------------------|
| `action`    | the action of the command, and its output                                    |
| `settings`  | settings as they are typed                                                   |
| `pictures`  | labelled pictures: the cameras over a dataset, relit, with new noise         |
| `patches`   | crops, flips, zooms and gains of pictures, and targets of the network        |
| `network`   | the network, and its boxes as a part of the exported file                    |
| `loss`      | focal loss of the centres, overlap of the boxes                              |
| `training`  | the loop, which can continue after an interruption                           |
| `export`    | ONNX file, `detector.yaml` and model card                                    |
"""
