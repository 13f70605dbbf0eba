"""The sky of an hour: day, twilight and night, as radiance by direction.

| file | holds |
|---|---|
| choice | the fields `sky` and `hour` of a road scene |
| state | sun, moon and site: presets, numbers, or a place and a time |
| place_and_time | sun and moon of a place and a time, by ephem |
| dome | the sky of a state, as a table |
| daylight | sky and sun by day: Mitsuba's `sunsky` |
| twilight | how the light of twilight is spread |
| night_light | luminance of airglow and stars, of moonlit air, and of the glow of towns |
| illuminance | what level ground gets from sun and moon, against their altitude |
| spectra | spectral power of each of these lights |
| air | air mass, transmission, refraction |
| grid | rows and columns of the table |
"""
