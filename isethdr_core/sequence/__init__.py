"""Sequence: frames one after the other, and the exposure that is carried from frame to frame.

A frame is a run. Its config states the exposure that each camera carries into it (`exposures`), so
a frame can be computed again by itself.

| module             | content                                                                     |
|--------------------|-----------------------------------------------------------------------------|
| `exposure`         | exposure, gain and their limits; the table `exposures` of a config, checked |
| `exposure_control` | automatic exposure that settles over the frames                             |
| `frame_exposures`  | the cameras of a frame at their carried exposures, and what they meter      |
| `equal_content`    | digests of a scene description, by which equal light is recognised          |
| `equal_groups`     | light groups of another frame that are taken over: their light is the same  |
| `equal_radiance`   | stored radiance of another scene that shows the same light                  |
| `frame_seed`       | the renderer's random numbers of one frame of a sequence                    |
"""
