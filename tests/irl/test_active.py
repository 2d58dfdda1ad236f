from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch

import irl.active
import irl.training
from irl.active import ActiveConfig, active_fa_mlirl
from irl.active_state import identity, training_files
from irl.advice import Advice
from irl.cluster_queries import select_cluster
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import DOWN, LEFT, RIGHT, UP, GridWorld
from irl.errors import InputError
from irl.experts import ClusterAdvice, OracleExpert
from irl.function_approx import Learner
from irl.generalisation import Generalisation
from irl.likelihood import LikelihoodProblem
from irl.planning import policy_success
from irl.policy import Policy
from irl.preferences import StatePreferences
from irl.problem import LearningProblem
from irl.queries import COMMITTEE_STRATEGIES, STATE_STRATEGIES, QueryContext, select_states
from irl.teacher import Teacher
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction, torch_generator

torch.set_num_threads(1)  # networks this small gain nothing from more

WORLD = GridWorld(7, (3, 3))
CONFIG = ActiveConfig(
    initial=TrainingConfig(iterations=200, step=0.01, beta=70.0, schedule="none"),
    refine=TrainingConfig(iterations=100, step=0.01, beta=70.0, schedule="none"),
    budget=6,
    query_beta=70.0,
    hidden=(16, 16),
    prefer="thesis",
)
CLUSTERS = {"left": np.flatnonzero(WORLD.cells[:, 0] < 3), "top": np.arange(42, 49)}
ONE_CORNER = Demonstrations.from_pairs(WORLD.trajectories("diagonal")[0])


@dataclass
class Guide:
    """Walks to the goal, and knows what to do left of it and at the top."""

    asked: list[int]
    advised: list[str]

    def label(self, state, rng):
        dx, dy = np.array(WORLD.goal) - WORLD.cells[state]
        return (RIGHT if dx > 0 else LEFT) if dx else (UP if dy > 0 else DOWN)

    def trajectory(self, state, rng, max_steps=50):
        self.asked.append(state)
        pairs = []
        while state != WORLD.goal_state:
            pairs.append((int(state), self.label(state, rng)))
            state = WORLD.model.P.indices[WORLD.model.pair_index(*pairs[-1])]
        return pairs

    def advise(self, cluster, states):
        self.advised.append(cluster)
        assert states is CLUSTERS[cluster]
        avoided, preferred = {"left": (LEFT, RIGHT), "top": (UP, DOWN)}[cluster]
        return ClusterAdvice(frozenset({preferred}), frozenset({avoided}))


PROBLEM = LearningProblem(WORLD.model, WORLD.features, gamma=0.9, clusters=CLUSTERS)
NETWORKS_SEE = replace(PROBLEM, features=WORLD.features.astype(np.float32))
ABOUT_THE_TEACHER = {"demonstrator", "expert", "generalisation", "rules"}
HOW = {"rng", "callback", "checkpoint", "demonstrations"}


def run(config=CONFIG, seed=0, **changes):
    """Learn, with a field of the problem, of the teacher, or an argument of the call changed."""
    guide = Guide([], [])
    of_teacher = {k: v for k, v in changes.items() if k in ABOUT_THE_TEACHER}
    how = {"rng": np.random.default_rng(seed)} | {k: v for k, v in changes.items() if k in HOW}
    of_problem = {k: v for k, v in changes.items() if k not in {*of_teacher, *how}}
    problem = replace(PROBLEM, start_states=None, **of_problem)
    teacher = Teacher(**({"demonstrator": guide, "expert": guide} | of_teacher))
    demonstrations = how.pop("demonstrations", ONE_CORNER)
    return active_fa_mlirl(problem, demonstrations, teacher, config, **how), guide


def accuracy(result):
    return WORLD.accuracy(result.q.argmax(axis=1))


def test_a_planned_policy_settles_only_where_demonstrations_ended():
    """From one corner's run a network has hilltops of its own; the plan leaves them all."""
    config = replace(CONFIG, budget=0, action_advice=False)
    goal = np.array([WORLD.goal_state])
    reached = {"greedy": [], "planned": []}
    for update, shares in reached.items():
        for seed in range(3):
            result, _ = run(replace(config, policy_update=update), seed)
            act = Policy.from_q(result.q, WORLD.model.mask).action
            shares.append(policy_success(WORLD.model, act, goal, 49).mean())
    assert min(reached["greedy"]) < 1
    assert reached["planned"] == [1, 1, 1]


def test_queries_improve_the_policy_within_budget():
    before, _ = run(replace(CONFIG, budget=0, action_advice=False))
    after, guide = run(replace(CONFIG, action_advice=False))
    assert accuracy(before) < 1
    assert accuracy(after) > accuracy(before)
    assert len(after.history) == len(guide.asked) == 6
    assert not np.isin(guide.asked[0], ONE_CORNER.state)
    assert len(set(guide.asked)) == 6
    # At the goal there is nothing to show.
    labelled = set(after.demonstrations.state.tolist())
    assert set(guide.asked) - {WORLD.goal_state} <= labelled
    assert guide.advised == []
    assert not after.advice.preferred.any()


def test_an_earlier_result_is_gone_on_from_without_training_again():
    first, _ = run(replace(CONFIG, budget=0))
    told = []
    later, guide = run(demonstrations=first, callback=told.append, seed=1)
    assert [each.iteration for each in told if each.query == 0] == [0]
    whole = first.network.values(WORLD.features)
    (begun,) = [each for each in told if each.query == 0]
    assert np.array_equal(begun.q.argmax(axis=1), WORLD.model.q_values(whole).argmax(axis=1))
    assert len(guide.asked) == 6
    assert accuracy(later) > accuracy(first)
    # It stays as it was.
    assert np.array_equal(first.network.values(WORLD.features), whole)


def test_each_cluster_is_asked_once_and_its_advice_applied():
    result, guide = run()
    assert sorted(guide.advised) == ["left", "top"]
    assert [r.cluster for r in result.history] == [*guide.advised, None, None, None, None]
    left = np.setdiff1d(CLUSTERS["left"], np.flatnonzero(WORLD.cells[:, 0] == 0))
    assert (result.q[left, LEFT] == -np.inf).all()
    assert np.isfinite(result.q).any(axis=1).all()
    unadvised = WORLD.model.q_values(result.f)
    np.testing.assert_allclose(
        result.q[left, RIGHT], unadvised[left, RIGHT] + 0.2 * np.abs(unadvised[left, RIGHT])
    )


def test_thesis_constant_for_avoided_actions():
    result, _ = run(replace(CONFIG, budget=2, avoid="thesis"))
    assert result.q[result.advice.avoided & WORLD.model.mask].tolist() == [-2.0] * int(
        (result.advice.avoided & WORLD.model.mask).sum()
    )


def test_most_demonstrated_states_are_never_exceeded():
    counts = []
    result, _ = run(
        replace(CONFIG, budget=50, max_demonstrated=11),
        callback=lambda p: counts.append(p.labels.n_states_demonstrated),
    )
    assert max(counts) == result.demonstrations.n_states_demonstrated == 11
    with pytest.raises(InputError, match="max_demonstrated"):
        run(replace(CONFIG, max_demonstrated=3))


def test_every_answer_counts_and_checkpoints_keep_them_all(tmp_path, monkeypatch):
    config = replace(CONFIG, budget=2, action_advice=False)
    result, guide = run(config)
    walks = [ONE_CORNER.pairs, *(Guide([], []).trajectory(s, None) for s in guide.asked)]
    assert result.demonstrations.pairs == [pair for walk in walks for pair in walk]
    assert len(result.demonstrations) > result.demonstrations.n_states_demonstrated

    fits = []
    fit = Learner.fit

    def dies(self, *args, **kwargs):
        fits.append(args[0])
        if len(fits) == 3:
            raise KeyboardInterrupt
        return fit(self, *args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(Learner, "fit", dies)
        with pytest.raises(KeyboardInterrupt):
            run(config, checkpoint=tmp_path / "run")
    resumed, _ = run(config, checkpoint=tmp_path / "run")
    assert resumed.q.tobytes() == result.q.tobytes()
    assert resumed.demonstrations.pairs == result.demonstrations.pairs


def test_what_a_run_kept_of_one_label_a_state_is_refused_by_name(tmp_path, monkeypatch):
    config = replace(SHORT, budget=1)

    def of_old(*args):
        return {k: v for k, v in identity(*args).items() if k != "labels"}

    with monkeypatch.context() as patch:
        patch.setattr(irl.active, "identity", of_old)
        run(config, checkpoint=tmp_path / "run")
    with pytest.raises(InputError, match=r"run: kept by other work, differing in labels \(nothing"):
        run(config, checkpoint=tmp_path / "run")


def test_one_slip_among_ten_answers_and_the_order_of_rows_do_not_decide():
    """Nine times to the right from a cell of the left border, once up, where a way goes right."""
    cell, n = 21, 10
    runs = [[(cell, RIGHT)]] * 9 + [[(cell, UP)]] + [ONE_CORNER.pairs]
    shown = Demonstrations.from_trajectories(runs)
    config = replace(CONFIG, budget=0)
    q = run(config, demonstrations=shown)[0].q
    rng = np.random.default_rng(1)
    for _ in range(3):
        again = run(config, demonstrations=shown.select(rng.permutation(len(shown))))[0].q
        assert again.tobytes() == q.tobytes()
    assert q[cell].argmax() == RIGHT
    problem = LikelihoodProblem.of(WORLD.model, shown)
    pair = WORLD.model.pair_index(np.array([cell] * 2), np.array([RIGHT, UP]))
    share = problem.label_share[np.searchsorted(problem.seen.rows, pair)]
    assert share.tolist() == [9 / (n + len(ONE_CORNER)), 1 / (n + len(ONE_CORNER))]


def test_generalisation_enters_the_demonstrations():
    shown = [state for state in range(49) if state not in ONE_CORNER.state and state != 48]
    pairs = np.array([(s, Guide([], []).label(s, None)) for s in shown if s != WORLD.goal_state])
    twins = Generalisation(
        state=np.r_[pairs[:, 0], 48].astype(np.int32),
        action=np.r_[pairs[:, 1], LEFT].astype(np.int32),
        group=np.zeros(len(pairs) + 1, dtype=np.int32),
        rule=np.zeros(len(pairs) + 1, dtype=np.uint8),
        rule_names=["alike"],
    )
    plain, _ = run(replace(CONFIG, budget=1), candidates=pairs[:, 0])
    result, _ = run(replace(CONFIG, budget=1), generalisation=twins, candidates=pairs[:, 0])
    assert 48 not in plain.demonstrations.state
    assert (48, LEFT) in result.demonstrations.pairs


def test_runs_that_cannot_be_are_refused_before_and_while_learning():
    glued = Demonstrations.from_pairs([(0, RIGHT), (40, LEFT)])
    with pytest.raises(InputError, match="demonstrations: trajectory 0, step 0: action"):
        run(demonstrations=glued)

    class Leaper(Guide):
        def trajectory(self, state, rng, max_steps=50):
            return [*super().trajectory(state, rng)[:1], (0, RIGHT)]

    guide = Leaper([], [])
    with pytest.raises(InputError, match=r"answer about state \d+: trajectory \d+, step 0"):
        run(demonstrator=guide)
    assert len(guide.asked) == 1


def test_same_seed_same_bits():
    (one, _), (two, _) = run(), run()
    (other, _) = run(seed=1)[0], None
    assert torch.equal(one.network.parameters, two.network.parameters)
    assert np.array_equal(one.q, two.q)
    assert one.history == two.history
    assert not torch.equal(one.network.parameters, other.network.parameters)


def test_preferences_and_pinned_values_shape_f_and_can_be_switched_off():
    preferences = StatePreferences([WORLD.goal_state], [0])
    options = {"preferences": preferences, "fixed_vr": {5: 0.25}}
    config = replace(CONFIG, budget=0)
    result, _ = run(config, **options)
    plain, _ = run(replace(config, state_preferences=False), **options)
    np.testing.assert_allclose(result.f, preferences.apply(plain.f))
    assert plain.f[5] == 0.25


def test_progress_is_told_and_the_loop_ends_when_nothing_is_left():
    told = []
    config = replace(CONFIG, refine=replace(CONFIG.refine, iterations=3), budget=9)
    allowed = np.array([6, 48])
    result, guide = run(config, callback=told.append, candidates=allowed)
    assert sorted(guide.asked) == [6, 48]
    assert len(result.history) == 2
    learnt = [p for p in told if p.q is not None]
    assert [p.query for p in learnt] == [0, 1, 2]
    assert np.array_equal(learnt[-1].q, result.q)
    assert [p.iteration for p in told if p.query == 1] == [1, 2, 3, 3]


def test_learnt_beta_is_carried_on():
    refine = replace(CONFIG.refine, iterations=0)
    config = replace(
        CONFIG, initial=replace(CONFIG.initial, learn_beta=True), refine=refine, budget=1
    )
    result, _ = run(config)
    assert result.beta == result.history[0].beta != 70.0


def test_bellman_term_joins_in():
    config = replace(CONFIG, budget=0, initial=replace(CONFIG.initial, bellman_weight=1.0))
    assert not np.array_equal(run(config)[0].f, run(replace(CONFIG, budget=0))[0].f)


SHORT = replace(
    CONFIG,
    initial=replace(CONFIG.initial, iterations=40),
    refine=replace(CONFIG.refine, iterations=10),
)


@pytest.mark.parametrize("strategy", sorted(STATE_STRATEGIES.keys() - COMMITTEE_STRATEGIES))
def test_one_query_a_round_is_algorithm_4_1_step_by_step(strategy):
    config = replace(SHORT, state_query=strategy, budget=4)
    result, _ = run(config, seed=3)

    guide, rng = Guide([], []), np.random.default_rng(3)
    problem = NETWORKS_SEE
    network = VRFunction(2, config.hidden, generator=torch_generator(rng))
    learner = Learner(problem, network)
    labels, advice, asked, advised = ONE_CORNER, Advice.none(49, 4), [], []
    learner.fit(labels, config.initial, rng)
    for _ in range(config.budget):
        context = QueryContext(
            model=WORLD.model,
            q=advice.apply(WORLD.model.q_values(learner.values()), WORLD.model.mask),
            features=problem.features,
            demonstrated=labels.state,
            candidates=np.setdiff1d(np.arange(49), [*labels.state, *asked]),
            beta=config.query_beta,
            start_states=np.arange(49),
            rng=rng,
            ends=np.array([WORLD.goal_state]),  # where the guide always ends
            asked=len(asked),
        )
        asked += select_states(strategy, context).tolist()
        shown = guide.trajectory(asked[-1], rng)
        answer = Demonstrations.from_pairs(shown, trajectory=len(asked))
        labels = Demonstrations.concatenate([labels, answer])
        cluster = select_cluster("masked_entropy", context, CLUSTERS, advised)
        if cluster is not None:
            advised.append(cluster)
            answer = guide.advise(cluster, CLUSTERS[cluster])
            advice = advice.add(CLUSTERS[cluster], answer.preferred, answer.avoided)
        learner.fit(labels, config.refine, rng)
    assert [record.state for record in result.history] == asked
    assert [record.cluster for record in result.history] == [*advised, None, None]
    assert torch.equal(result.network.parameters, network.parameters)
    q = advice.apply(WORLD.model.q_values(learner.values()), WORLD.model.mask)
    assert result.q.tobytes() == q.tobytes()


@pytest.mark.parametrize("strategy", STATE_STRATEGIES)
def test_batches_count_questions_and_never_repeat_one(strategy):
    told = []
    config = replace(SHORT, state_query=strategy, budget=7, batch=3, committee=2)
    result, guide = run(config, callback=told.append)
    assert len(result.history) == len(guide.asked) == len(set(guide.asked)) == 7
    assert [p.query for p in told if p.q is not None] == [0, 3, 6, 7]
    assert sorted(guide.advised) == ["left", "top"]  # one with each of the first two questions
    assert [record.cluster is None for record in result.history] == [False, False] + [True] * 5
    again, _ = run(config)
    assert again.q.tobytes() == result.q.tobytes()
    assert again.history == result.history


def test_a_batch_ends_when_enough_is_demonstrated_or_nothing_is_left():
    result, guide = run(replace(SHORT, budget=40, batch=5, max_demonstrated=9))
    assert result.demonstrations.n_states_demonstrated == 9
    assert len(guide.asked) == len(result.history) < 5
    result, guide = run(replace(SHORT, budget=40, batch=5), candidates=np.array([6, 48, 7]))
    assert sorted(guide.asked) == [6, 7, 48]


@pytest.mark.parametrize("strategy", sorted(COMMITTEE_STRATEGIES))
def test_committees_leave_the_main_network_alone(strategy):
    """With another's questions out of the way, all networks learn the same."""
    options = {"candidates": np.array([48])}
    config = replace(SHORT, budget=1, initial=replace(SHORT.initial, bellman_weight=1.0))
    plain, _ = run(config, **options)
    result, guide = run(replace(config, state_query=strategy, committee=2), **options)
    assert guide.asked == [48]
    assert result.q.tobytes() == plain.q.tobytes()


def test_committee_members_differ_and_weigh_labels_for_good():
    problem = replace(NETWORKS_SEE, fixed_vr={0: 0.5})
    committee = Committee(problem, 3, (8,), np.random.default_rng(0))
    weights = [member.weight.copy() for member in committee.members]
    committee.fit(ONE_CORNER, SHORT.initial)
    f = np.stack([member.values() for member in committee.members])
    assert f.shape == (3, 49)
    assert (f[:, 0] == 0.5).all()
    assert all(np.ptp(f[:, s]) > 0 for s in range(1, 49))
    assert all(np.array_equal(m.weight, w) for m, w in zip(committee.members, weights, strict=True))
    assert min(w.min() for w in weights) > 0


@pytest.mark.parametrize(("weight", "alike"), [(np.full(49, 7.0), True), (np.arange(1, 50), False)])
def test_only_the_proportions_of_label_weights_count(weight, alike):
    problem = NETWORKS_SEE
    f = []
    for weights in (None, weight):
        network = VRFunction(2, (8,), generator=torch.Generator().manual_seed(0))
        learner = Learner(problem, network, weight=weights)
        learner.fit(ONE_CORNER, SHORT.initial, np.random.default_rng(0))
        f.append(learner.values())
    assert np.allclose(*f, atol=1e-5) == alike


def test_intersections_may_be_asked_about():
    class Listener(Guide):
        def advise(self, cluster, states):
            self.advised.append((cluster, states.tolist()))
            return ClusterAdvice(frozenset({UP}), frozenset())

    guide = Listener([], [])
    both = np.intersect1d(CLUSTERS["left"], CLUSTERS["top"])
    result, _ = run(replace(SHORT, cluster_intersections=1), expert=guide)
    assert ("left ∩ top", both.tolist()) in guide.advised
    assert len(guide.advised) == 3
    assert len([record for record in result.history if record.cluster]) == 3
    guide.advised.clear()
    run(replace(SHORT, cluster_intersections=1, smallest_intersection=4), expert=guide)
    assert sorted(name for name, _ in guide.advised) == ["left", "top"]


def test_an_expert_may_speak_of_an_intersection_instead():
    class Chooser(Guide):
        def advise(self, cluster, states):
            self.advised.append(cluster)
            return ClusterAdvice(frozenset({UP}), cluster="top ∩ left")

    guide = Chooser([], [])
    result, _ = run(replace(SHORT, cluster_intersections=0), expert=guide)
    assert sorted(guide.advised) == ["left", "top"]  # and the new one is not asked about
    assert [record.cluster for record in result.history[:3]] == ["top ∩ left"] * 2 + [None]
    both = np.intersect1d(CLUSTERS["left"], CLUSTERS["top"])
    assert np.flatnonzero(result.advice.preferred.any(axis=1)).tolist() == both.tolist()


class KilledError(Exception):
    pass


@pytest.mark.parametrize(
    ("strategy", "killed_after"),
    [("bald", 0), ("bald", 1), ("random", 1), ("visitation_entropy", 2), ("random", 3)],
)
def test_a_run_that_was_killed_goes_on_to_the_same_bits(tmp_path, strategy, killed_after):
    config = replace(
        SHORT,
        state_query=strategy,
        cluster_query="random",
        budget=5,
        batch=2,
        committee=2,
        cluster_intersections=1,
        initial=replace(SHORT.initial, bellman_weight=1.0, learn_beta=True),
    )
    path = tmp_path / "run.safetensors"
    expert = OracleExpert(OracleDemonstrator(WORLD.model, np.array([24])), np.arange(49))
    whole, _ = run(config, expert=expert)
    trainings = iter(range(99))

    def kill(progress):
        if progress.iteration == 5 and progress.q is None and next(trainings) == killed_after + 1:
            raise KilledError

    if killed_after < 3:
        with pytest.raises(KilledError):
            run(config, expert=expert, checkpoint=path, callback=kill)
    else:
        run(config, expert=expert, checkpoint=path)
    told = []
    resumed, guide = run(config, expert=expert, checkpoint=path, callback=told.append)
    assert len(guide.asked) == max(0, 5 - 2 * killed_after)
    assert {p.query for p in told} == {k for k in (2, 4, 5) if k > 2 * killed_after}
    assert resumed.q.tobytes() == whole.q.tobytes()
    assert resumed.f.tobytes() == whole.f.tobytes()
    assert torch.equal(resumed.network.parameters, whole.network.parameters)
    assert resumed.history == whole.history
    assert resumed.beta == whole.beta
    assert resumed.demonstrations.pairs == whole.demonstrations.pairs
    assert np.array_equal(resumed.advice.avoided, whole.advice.avoided)


def test_a_first_training_that_was_killed_does_not_start_again(tmp_path, monkeypatch):
    monkeypatch.setattr("irl.active_state.EVERY", 10)
    config = replace(SHORT, budget=2, initial=replace(SHORT.initial, bellman_weight=1.0))
    path = tmp_path / "run.safetensors"
    whole, _ = run(config)

    def kill(progress):
        if progress.iteration == 25:
            raise KilledError

    with pytest.raises(KilledError):
        run(config, checkpoint=path, callback=kill)
    assert not path.exists()
    assert [p.name for p in training_files(path)] == ["run.safetensors.training-main"]
    told = []
    resumed, _ = run(config, checkpoint=path, callback=told.append)
    assert [p.iteration for p in told if p.query == 0] == [*range(21, 41), 40]
    assert resumed.q.tobytes() == whole.q.tobytes()
    assert torch.equal(resumed.network.parameters, whole.network.parameters)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_committee_that_was_killed_in_its_first_training_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr("irl.active_state.EVERY", 10)
    config = replace(SHORT, budget=2, state_query="bald", committee=3)
    path = tmp_path / "run.safetensors"
    whole, _ = run(config)
    steps, save = [], irl.training.save

    def save_or_die(file, arrays, state, identity):
        if file.name.endswith("member1") and state["done"] == 30:
            raise KilledError
        steps.append((file.name.rpartition("-")[2], state["done"]))
        save(file, arrays, state, identity)

    monkeypatch.setattr("irl.training.save", save_or_die)
    with pytest.raises(KilledError):
        run(config, checkpoint=path)
    monkeypatch.setattr(
        "irl.training.save", lambda *all_: (steps.append(("again", all_[0].name)), save(*all_))
    )
    resumed, _ = run(config, checkpoint=path)
    assert ("member1", 20) in steps
    again = [name.rpartition("-")[2] for mark, name in steps if mark == "again"]
    assert again == ["member1"] * 3 + ["member2"] * 6  # at 30, 40 and the end; all of the last
    assert resumed.q.tobytes() == whole.q.tobytes()
    assert resumed.history == whole.history
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("name", "config", "options"),
    [
        ("batch", {"batch": 2}, {}),
        ("initial", {"initial": replace(SHORT.initial, step=0.02)}, {}),
        ("gamma", {}, {"gamma": 0.8}),
        ("rng", {}, {"rng": np.random.default_rng(9)}),
        ("features", {}, {"features": WORLD.features + 1}),
        ("model", {}, {"model": GridWorld(7, (0, 0)).model.__class__.from_entries(
            49, 4, np.arange(48), np.full(48, RIGHT), np.arange(1, 49), np.ones(48)),
            "demonstrations": Demonstrations.from_pairs([(0, RIGHT)])}),
        ("demonstrations", {}, {"demonstrations": Demonstrations.from_pairs([(0, UP)])}),
        ("clusters", {}, {"clusters": {"top": CLUSTERS["top"]}}),
        ("candidates", {}, {"candidates": np.array([6, 48])}),
        ("preferred", {}, {"preferences": StatePreferences([3])}),
        ("fixed_vr", {}, {"fixed_vr": {3: 0.1}}),
    ],
)  # fmt: skip
def test_a_foreign_checkpoint_is_refused(tmp_path, name, config, options):
    path = tmp_path / "run.safetensors"
    short = replace(SHORT, budget=1)
    run(short, checkpoint=path)
    with pytest.raises(InputError, match=rf"run\.safetensors.*differing in .*{name} \("):
        run(replace(short, **config), checkpoint=path, **options)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(InputError, match=r"run\.safetensors"):
        run(short, checkpoint=path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"batch": 0}, "batch"),
        ({"committee": 1}, "committee"),
        ({"cluster_intersections": -1}, "cluster_intersections"),
        ({"smallest_intersection": 0}, "smallest_intersection"),
        ({"state_query": "entropy"}, "state_query.*margin"),
        ({"cluster_query": "margin"}, "cluster_query.*none"),
        ({"avoid": "no"}, "avoid"),
        ({"budget": -1}, "budget"),
        ({"query_beta": 0.0}, "query_beta"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        ActiveConfig(**options)
