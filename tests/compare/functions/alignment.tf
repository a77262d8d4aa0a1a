# A solid object of 0 and 255.
 96    1 1 1  0
160    1 1 1  0.95
