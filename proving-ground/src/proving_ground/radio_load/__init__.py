"""Radio load tests: the same squad over the same emulated link, told by our hub and by the formats others use.

`squad_tracks` are what the soldiers' fusions say, `contest` plays them through a sender's rule, an encoder and the
air, `command` prints a row for each format.
"""
