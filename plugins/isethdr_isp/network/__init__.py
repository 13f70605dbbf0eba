"""Network: a trained model from an ONNX file develops the captures.

| module           | content                                                                 |
|------------------|-------------------------------------------------------------------------|
| `contract`       | what a model file states of itself; checks of it against a sensor       |
| `contract_model` | a model of the contract: XYZ in electrons, then cd/m2                   |
| `fields`         | the fields of the component                                             |
| `isp`            | the component `isp=network`                                             |
| `model_file`     | opens a file and tells its layout                                       |
| `published`      | a model in the layout of the ISETHDR paper: planes in, planes out       |
| `reach`          | how far away an output depends on inputs, measured                      |
| `running`        | a model over all tiles of a picture                                     |
| `samples`        | the captures of a shot as planes of electrons, noise, masks             |
| `tiles`          | a picture of any size in overlapping tiles, with the array's phase kept |

`isethdr_core.onnx_session` opens the files; `readout/` makes electrons, as for the other isps.
"""
