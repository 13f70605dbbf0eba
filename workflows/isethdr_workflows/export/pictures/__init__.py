"""Pictures and light as files.

| module     | content                                                              |
|------------|----------------------------------------------------------------------|
| `png`      | pictures as displayed by the report, 8 bit sRGB                      |
| `animation` | a sequence as an animated PNG for each camera                        |
| `exr`      | pictures and references, linear, cd/m2                               |
| `radiance` | spectral radiance, EXR with one part for each light group            |
| `raw`      | captures as DNG                                                      |
"""
