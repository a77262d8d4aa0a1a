# Engine block, CT: the housing translucent, the metal parts solid.
values data
unit voxel
  70   0.45 0.50 0.60  0
 100   0.55 0.62 0.72  0.03
 150   0.60 0.68 0.78  0.04
 185   0.95 0.75 0.40  0.10
 220   1.00 0.80 0.45  0.60
 255   1.00 0.90 0.70  0.90
