"""Network: a trained model from an ONNX file develops the captures.

| module           | content                                                                 |
|------------------|-------------------------------------------------------------------------|
| `contract`       | properties that a model file states, and checks against a sensor        |
| `contract_model` | a model with the contract: from planes to XYZ in electrons, then cd/m2  |
| `fields`         | the fields of the component                                             |
| `isp`            | the component `isp=network`                                             |
| `model_file`     | opens a file and identifies its layout                                  |
| `published`      | a model in the layout of the ISETHDR paper: from planes to planes       |
| `reach`          | measures the largest distance from an output to inputs that it uses     |
| `running`        | applies a model to all tiles of a picture                               |
| `samples`        | the captures of a shot as planes of electrons, noise, masks             |
| `tiles`          | a picture of any size in overlapping tiles, with the array's phase kept |

`isethdr_core.onnx_session` opens the files; `readout/` converts DN to electrons, as for other isps.
"""
