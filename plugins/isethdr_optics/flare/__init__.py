"""Flare: dirty apertures, haze and ghosts.

| module     | what                                                                      |
|------------|---------------------------------------------------------------------------|
| `aperture` | what dirties the light on its way, and what a flare of your own may offer |
| `haze`     | a broad veil with a measured-style scatter function, Harvey-Shack or ABg  |
| `ghosts/`  | light reflected twice between surfaces of a lens prescription             |
"""
