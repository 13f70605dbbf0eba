"""Questions: studies over a dataset that answer one question, with intervals over roads.

| module              | question or content                                                    |
|---------------------|------------------------------------------------------------------------|
| `dirt`              | shares of scatter, ghosts and noise in the loss through a dirty lens   |
| `render_noise`      | whether the renderer's noise or its denoiser changes that answer       |
| `picture_noise`     | whether they change the answers about networks and filters             |
| `term_scores`       | scores of a scene with each set of terms switched on                   |
| `shares`            | division of a loss among terms that depend on each other (Shapley)     |
| `radiance_versions` | stored radiance as it is, either of its half buffers, or denoised      |
| `tables`            | rows of a study as a table in Markdown                                 |
"""
