# Engine block, CT: only the dense metal parts.
185    0.95 0.75 0.40  0
220    1.00 0.80 0.45  0.60
255    1.00 0.90 0.70  0.90
