# Smoke: opacity follows the density, over three orders of magnitude.
0.004  0.70 0.72 0.75  0
0.05   0.75 0.77 0.80  0.01
0.40   0.85 0.86 0.88  0.08
2.00   0.95 0.95 0.95  0.30
6.00   1.00 1.00 1.00  0.60
