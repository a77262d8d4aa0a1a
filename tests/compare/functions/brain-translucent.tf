# Brain, MRI, extracted: all of it, translucent.
60    0.55 0.45 0.90  0
255   1.00 0.95 0.80  0.4
