"""A learnt policy played from many starts, in full physics or by forecast alone."""
