"""Questions: studies over a dataset that answer one question, with intervals over roads.

| module              | question or content                                                    |
|---------------------|------------------------------------------------------------------------|
| `dirt`              | which share of the loss behind a dirty lens is scatter, ghosts, noise  |
| `render_noise`      | whether the renderer's noise or its denoiser changes that answer       |
| `picture_noise`     | whether they change the answers about networks and filters             |
| `term_scores`       | scores of a scene with each set of terms switched on                   |
| `shares`            | fair shares of a loss among terms that do not commute                  |
| `radiance_versions` | stored radiance, either half of its samples, or denoised               |
| `tables`            | rows of a study as a table in Markdown                                 |
"""
