"""Asset packs: folders of users' own meshes with a manifest, drawn together with bundled families.

| module     | content                                                              |
|------------|----------------------------------------------------------------------|
| manifest   | fields of `pack.yaml`                                                |
| entries    | checks that groups, materials, lamps and files of a manifest exist   |
| mesh_file  | parts and colours of a GLB, OBJ or PLY, by trimesh                   |
| soundness  | NaN, holes, faces without area, sizes beyond the range of a group    |
| surfaces   | the material of each face                                            |
| emitters   | the faces that are lamps                                             |
| asset      | a mesh in metres with materials and lamps, as a thing of a street    |
| pack       | reads a folder as a whole and reports all its mistakes at once       |
| report     | the table of `isethdr things check`                                  |
"""
