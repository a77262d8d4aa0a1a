# Tooth, CT: the dentine translucent, the enamel nearly solid.
 500   0.70 0.45 0.35  0
 700   0.85 0.65 0.50  0.03
 900   0.90 0.75 0.60  0.04
1050   1.00 0.95 0.85  0.15
1300   1.00 1.00 0.95  0.60
