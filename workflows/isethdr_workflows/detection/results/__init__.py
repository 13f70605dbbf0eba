"""Results of a study of detection: shares, intervals and curves, and the files that show them.

| module           | what                                                                      |
|------------------|---------------------------------------------------------------------------|
| `study_results`  | all results of a study                                                    |
| `shares`         | objects found by class, distance, ...; roads needed to compare cameras    |
| `levels`         | shares against the level of light, and where they cross                   |
| `curves`         | the curves of all cameras, with their intervals                           |
| `recall`         | the recall of detectors and of the observer, for the same objects         |
| `checks`         | checks of the observer by counting                                        |
| `number_text`    | texts of shares, intervals, crossings                                     |
| `summary`        | the rows that the command prints and stores                               |
| `files`          | all files of a study in the folder of its dataset                         |
| `page`           | the page as one HTML document                                             |
| `markdown`       | the tables as Markdown                                                    |
| `csv_tables`     | the tables as CSV                                                         |
| `curve_picture`  | the curves of all cameras as one picture                                  |
| `recall_picture` | the recall of detectors against the share that the observer finds         |
"""
