"""Detectors: networks in ONNX files, on pictures of runs, scored with intervals over roads.

`isethdr study detector_scores detector=FILE.yaml dataset=NAME`

| module          | what                                                                      |
|-----------------|---------------------------------------------------------------------------|
| `classes`       | car, truck, person, rider, animal: the class of an object                 |
| `description`   | `detector.yaml`: what a network reads, what it says, its classes          |
| `picture_input` | from a picture of a run to the network's input, and boxes back            |
| `outputs`       | from the network's outputs to boxes, scores and classes                   |
| `boxes`         | forms of boxes, their overlap, non-maximum suppression                    |
| `detector`      | a detector, ready to use                                                  |
| `objects`       | the objects of a picture, their distance, light, and lamps close by       |
| `groups`        | groups of objects by distance, height, illuminance, lamps                 |
| `matching`      | which detection is which object, by hotcoco                               |
| `precision`     | average precision and recall for many draws of roads at once              |
| `bootstrap`     | intervals over roads and over trained detectors                           |
| `tables`        | rows of scores, of differences, of roads that tell a difference           |
| `rows`          | rows of objects: found or not, behind which camera                        |
| `study`         | the study `detector_scores`                                               |
"""
