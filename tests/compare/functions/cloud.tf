# A cloud: white, thick within a few voxels.
0.01   0.95 0.97 1.00  0
0.50   0.97 0.98 1.00  0.06
1.00   1.00 1.00 1.00  0.14
