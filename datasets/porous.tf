# A porous scan of triptych-generate: the solid opaque, the pores clear.
values data
unit voxel
    0     0.85 0.62 0.40  0
15000     0.85 0.62 0.40  0
30000     0.92 0.85 0.72  0.4
65535     1.00 0.97 0.90  0.4
