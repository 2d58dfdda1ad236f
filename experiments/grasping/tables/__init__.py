"""Table 6.3 and beyond: what the network of Algorithm 4.1 learns, and what buys what."""
