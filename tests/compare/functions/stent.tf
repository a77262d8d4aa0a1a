# Abdominal aorta with a stent: vessels red, bone white, the stent brightest.
0.13   0.80 0.30 0.20  0
0.22   0.85 0.35 0.25  0.20
0.40   0.95 0.90 0.80  0.60
1.00   1.00 1.00 1.00  0.95
