# bone over skin
unit voxel
values data
0 0 0 0 0
100 .8 .5 .4 0.02 # skin
100 1 1 .9 .5
255 1 1 1 1
