"""Training of a small detector, `isethdr train detector`: one for all cameras, from nothing.

| module      | content                                                                      |
|-------------|------------------------------------------------------------------------------|
| `action`    | what the command does and prints                                             |
| `settings`  | settings as they are typed                                                   |
| `pictures`  | labelled pictures: runs of the cameras over a dataset, relit, with new noise |
| `patches`   | crops, flips, zooms and gains of pictures, and what the network should say   |
| `network`   | the network, and its boxes as a part of the exported file                    |
| `loss`      | focal loss of the centres, overlap of the boxes                              |
| `training`  | the loop, which goes on after a kill                                         |
| `export`    | ONNX file, `detector.yaml` and model card                                    |
"""
