import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError
from irl.teacher import Teacher


def test_by_default_a_demonstration_speaks_for_itself_alone(chain):
    shown = Demonstrations.from_pairs([(0, 1), (1, 1), (0, 0)])
    teacher = Teacher(OracleDemonstrator(chain, np.array([3])))
    assert teacher.expert is None
    # A state shown twice keeps both labels: (3.19) counts each.
    assert teacher.generalise(shown).pairs == shown.pairs


def test_rules_say_what_follows_and_may_be_left_out(chain, small_task):
    demonstrator = OracleDemonstrator(chain, np.array([3]))
    groups = small_task.generalisation
    shown = Demonstrations.from_pairs([(int(groups.state[0]), int(groups.action[0]))])
    with_all = Teacher(demonstrator, generalisation=groups)
    with_none = Teacher(demonstrator, generalisation=groups, rules=[])
    assert len(with_all.generalise(shown)) > 1
    assert with_none.generalise(shown).pairs == shown.pairs
    with pytest.raises(InputError, match="no rule 'magic'"):
        Teacher(demonstrator, generalisation=groups, rules=["magic"])
