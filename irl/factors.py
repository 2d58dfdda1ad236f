"""Features that name what a state is: one column for each value of a factor.

Features of nearness say what resembles what; these say what is the same. A factor is one or more
columns of a task's ``states.csv`` taken together, such as the coordinates of a cell.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from irl.choices import check_choice


def one_hot(states: Sequence[Mapping[str, str]], factors: Iterable[Sequence[str]]) -> np.ndarray:
    """One column for each value of each factor, in the order of first occurrence.

    Args:
        states: one row of readable columns a state, as in ``states.csv``.
        factors: names of columns, of each factor.

    Returns:
        float32 ``[n_states, d]``, a single 1 a state and factor.

    Raises:
        InputError: if a column is unknown; lists the valid ones.
    """
    parts = []
    for columns in factors:
        for column in columns:
            check_choice("factors", column, states[0])
        values = [tuple(row[column] for column in columns) for row in states]
        number = {value: k for k, value in enumerate(dict.fromkeys(values))}
        parts.append(np.eye(len(number), dtype=np.float32)[[number[value] for value in values]])
    return np.concatenate(parts, axis=1)
