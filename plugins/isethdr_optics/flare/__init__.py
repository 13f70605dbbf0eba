"""Flare: dirty apertures, haze and ghosts.

| module     | content                                                                  |
|------------|--------------------------------------------------------------------------|
| `aperture` | the flares `ideal` and `aperture`: blades, dust and scratches            |
| `haze`     | a broad veil with a measured-style scatter function, Harvey-Shack or ABg |
| `ghosts/`  | light reflected twice between surfaces of a lens prescription            |
"""
