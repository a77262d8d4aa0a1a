# The signal of Marschner and Lobb: a veil about its surface at 1/2, and what is above.
100   0.20 0.40 0.90  0
128   0.95 0.75 0.35  0.060
255   1.00 0.95 0.85  0.025
