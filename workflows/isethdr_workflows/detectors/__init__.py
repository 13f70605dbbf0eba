"""Detectors: networks in ONNX files, on pictures of runs, scored with intervals over roads.

`isethdr study detector_scores detector=FILE.yaml dataset=NAME`

| module          | what                                                                      |
|-----------------|---------------------------------------------------------------------------|
| `classes`       | car, truck, person, rider, animal: the class of an object                 |
| `description`   | `detector.yaml`: input, outputs and classes of a network                  |
| `picture_input` | from a picture of a run to the network's input, and boxes back            |
| `outputs`       | from the network's outputs to boxes, scores and classes                   |
| `boxes`         | forms of boxes, their overlap, non-maximum suppression                    |
| `detector`      | a detector, ready to use                                                  |
| `objects`       | the objects of a picture: distance, illuminance, nearby lamps             |
| `groups`        | groups of objects by distance, height, illuminance, lamps                 |
| `matching`      | matches of detections and objects, by hotcoco                             |
| `precision`     | average precision and recall for many draws of roads at the same time     |
| `bootstrap`     | intervals over roads and over trained detectors                           |
| `tables`        | rows of scores, differences, and roads needed to detect a difference      |
| `rows`          | rows of objects: whether each was found, by camera                        |
| `study`         | the study `detector_scores`                                               |
"""
