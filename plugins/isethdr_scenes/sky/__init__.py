"""The sky of an hour by day, in twilight or by night, as radiance by direction.

| file | holds |
|---|---|
| choice | the fields `sky` and `hour` of a road scene |
| state | sun, moon and site: presets, numbers, or a place and a time |
| place_and_time | sun and moon of a place and a time, by ephem |
| dome | the sky of a state, as a table |
| daylight | sky and sun by day: Mitsuba's `sunsky` |
| twilight | distribution of the light of twilight over the sky |
| night_light | luminance of airglow and stars, of moonlit air, and of the glow of towns |
| illuminance | illuminance of level ground by sun and moon, by their altitude |
| spectra | spectral power of each of these lights |
| air | air mass, transmission, refraction |
| grid | rows and columns of the table |
"""
