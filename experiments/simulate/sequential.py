"""A paired test that may be looked at after every pair: it stays valid however often one looks.

Of the pairs that differ, one side wins each. Whoever believes that side A wins more than half of
them bets so, by every share from ½ to 1 alike; what became of the stake is evidence (Waudby-Smith
and Ramdas, JRSS B 86, 2024). If A wins at most half of them, the stake reaches k times what it was,
ever, with a probability of at most 1/k (Ville's inequality).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import betainc, betaln


def log_evidence(wins: int, losses: int) -> float:
    """Logarithm of the stake after so many wins and losses.

    ∫ from ½ to 1 of 2·(2p)^wins·(2 − 2p)^losses dp.
    """
    tail = betainc(losses + 1, wins + 1, 0.5)
    with np.errstate(divide="ignore"):
        return float(
            (wins + losses + 1) * np.log(2.0) + betaln(wins + 1, losses + 1) + np.log(tail)
        )


@dataclass(frozen=True)
class Duel:
    """How two sides stand after some pairs.

    Attributes:
        wins: of the first side.
        losses: of the first side, which the second won.
        even: pairs that don't tell the sides apart.
        most: largest evidence so far that the first side wins more than half, and the same of the
            second, as logarithms.
    """

    wins: int = 0
    losses: int = 0
    even: int = 0
    most: tuple[float, float] = (0.0, 0.0)

    def after(self, winner: int) -> "Duel":
        """After one pair more, won by the first side (1), the second (−1), or neither (0)."""
        if winner == 0:
            return replace(self, even=self.even + 1)
        wins, losses = self.wins + (winner > 0), self.losses + (winner < 0)
        most = (
            max(self.most[0], log_evidence(wins, losses)),
            max(self.most[1], log_evidence(losses, wins)),
        )
        return Duel(wins, losses, self.even, most)

    @property
    def confidence(self) -> float:
        """That the side which is ahead is better; 1 less what both mistakes can come to."""
        return float(max(0.0, 1.0 - 2.0 * np.exp(-max(self.most))))

    @property
    def ahead(self) -> int:
        """Which side has more evidence: 1 the first, −1 the second, 0 neither."""
        return int(np.sign(self.most[0] - self.most[1]))
