# Brain, MRI, extracted: the surface, opaque within a voxel or two.
 60    0.85 0.65 0.55  0
 80    0.90 0.72 0.62  0.90
130    1.00 0.90 0.80  0.95
