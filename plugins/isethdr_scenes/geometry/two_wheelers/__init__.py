"""Two-wheelers: bicycles, motorcycles and scooters, each from a table of its proportions.

| module     | content                                                           |
|------------|-------------------------------------------------------------------|
| bicycle    | frame, wheels, handlebars and fittings of bicycles                |
| hull       | smooth closed bodies through sections: tanks, seats and fairings  |
| motorcycle | naked, sports, touring machines and cruisers                      |
| scooter    | step-through bodies with an apron                                 |
| fittings   | wheels, forks, mirrors, plates and lamps of motorcycles, scooters |
"""
