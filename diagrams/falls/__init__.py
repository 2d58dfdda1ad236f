"""How a cube that nothing holds falls and lands, blow by blow.

A blow on the table lasts a millisecond, and whether the cube tumbles depends on it: this asks for a
thousand times the accuracy that a grip needs. In reading order:

* `scene`: cube, table and the shapes of the hand by themselves, integrated with error control;
* `station`: the same, while the whole station is simulated in equal steps.
"""
