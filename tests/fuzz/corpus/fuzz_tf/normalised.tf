values normalised
unit 2.5e-1
0 0 0 0 0
1 1 1 1 .3
