"""Active FA-MLIRL, thesis Algorithm 4.1: learn, ask for what is least certain, learn again."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from irl.active_config import ActiveConfig, Progress
from irl.active_state import ActiveFiles, QueryRecord, identity
from irl.advice import Advice
from irl.checkpoint import fingerprint
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.experts import Expert
from irl.lesson_events import DONE, Advised, Answered, Event
from irl.preferences import StatePreferences
from irl.problem import LearningProblem
from irl.session_network import NetworkSession, begin
from irl.teacher import Teacher
from irl.vr_function import VRFunction

__all__ = ["ActiveConfig", "Progress", "Result", "active_fa_mlirl"]

_SILENT = 10**12
"""From here on answers are numbered that show nothing."""


@dataclass(frozen=True)
class Result:
    """What the algorithm learnt.

    Attributes:
        q: float64 ``[n_states, n_actions]``, advice included, −∞ where excluded; the policy is
            its argmax (PolicyUpdate).
        f: float64 ``[n_states]``, state preferences included; what ``q`` follows from, at once or
            by planning anew.
        beta: the inverse temperature at the end.
        caution: the dislike of uncertain outcomes at the end.
        network: the VR function.
        demonstrations: all labels at the end.
        advice: all advice at the end.
        ends: int64, where demonstrators ended, or were asked and had nothing to do.
        history: one record a query.
    """

    q: np.ndarray
    f: np.ndarray
    beta: float
    caution: float
    network: VRFunction
    demonstrations: Demonstrations
    advice: Advice
    ends: np.ndarray
    history: list[QueryRecord]


def active_fa_mlirl(
    problem: LearningProblem,
    demonstrations: "Demonstrations | Result",
    teacher: Teacher,
    config: ActiveConfig | None = None,
    *,
    rng: np.random.Generator,
    callback: Callable[[Progress], None] | None = None,
    checkpoint: Path | None = None,
) -> Result:
    """Run Algorithm 4.1 from the initial demonstrations to the final action values.

    No state and no cluster is asked about twice. An expert may answer about another cluster than
    it was asked for, or an intersection; that then joins the clusters (§5.11). With a batch,
    every question about states is chosen before the first is answered. The loop ends early when
    no state is left to ask about or ``config.max_demonstrated`` is reached.

    Args:
        problem: what is known beforehand, with features; its discount factor is used by the
            Bellman penalty and by a policy update that plans.
        demonstrations: D₀; or what an earlier run learnt, without its advice, to go on from there:
            then the first training is left out.
        teacher: answers questions; without an expert there is no advice.
        config: every choice; the thesis' by default.
        rng: the only source of chance, the network's initialisation included.
        callback: told of every iteration and every learnt policy.
        checkpoint: a file to save the state of affairs to after each training, with files of the
            same name and a suffix while a training goes on. If it exists, the run goes on from
            there, to the same bits as without interruption; earlier progress is not told again.

    Raises:
        InputError: if the problem has no features, a demonstration or an answer is invalid, D₀
            labels more states than ``config.max_demonstrated``, or a checkpoint is damaged or
            comes from a run with other settings or data.
        OSError: if a checkpoint cannot be written.
    """
    config, network = config or ActiveConfig(), None
    if isinstance(demonstrations, Result):
        earlier, network = demonstrations, demonstrations.network
        start = replace(config.initial, iterations=0, beta=earlier.beta)
        config = replace(config, initial=replace(start, caution=max(earlier.caution, 0.0)))
        demonstrations = earlier.demonstrations
    problem = replace(problem, features=problem.required_features(np.float32))
    if not config.state_preferences:
        problem = replace(problem, preferences=StatePreferences())
    if not config.action_advice or config.cluster_query == "none":
        teacher = replace(teacher, expert=None)
    demonstrations.check(problem.model, "demonstrations")
    most, labelled = config.max_demonstrated, demonstrations.n_states_demonstrated
    if most is not None and labelled > most:
        raise InputError(
            f"max_demonstrated: {most} is below the {labelled} states that the initial "
            "demonstrations label"
        )
    advised = teacher.expert is not None
    state = begin(problem, demonstrations, config, rng, advised=advised)
    work = identity(state, problem, config)
    if network is not None:
        state.learner.network = VRFunction.from_arrays(network.arrays(), config.device)
        work["network"] = fingerprint(*network.arrays().values())
    files = ActiveFiles(checkpoint, work)
    session = NetworkSession(
        problem, state, config, teacher.generalise, source="demonstrator", files=files
    )
    session.refit(callback)
    while (left := config.budget - len(state.history)) > 0 and not state.is_full(most):
        questions = session.propose(min(config.batch, left))
        for question in questions:
            if state.is_full(most):
                break
            session.apply(_shown(session, teacher, question.state))
            if teacher.expert is not None:
                session.apply(_advice(session, teacher.expert))
        if not questions:
            break
        session.refit(callback)
    return Result(
        q=session.q,
        f=problem.preferences.apply(state.learner.values()),
        beta=state.learner.beta,
        caution=state.learner.caution or 0.0,
        network=state.learner.network,
        demonstrations=state.labels,
        advice=state.advice,
        ends=state.ends(problem.model),
        history=state.history,
    )


def _shown(session: NetworkSession, teacher: Teacher, state: int) -> list[Event]:
    """What the demonstrator shows from a state on; that there is nothing to do, if nothing."""
    pairs = teacher.demonstrator.trajectory(state, session.state.rng)
    number = int(session.state.labels.trajectory.max()) + 1
    shown = Demonstrations.from_pairs(pairs, trajectory=number)
    shown.check(session.problem.model, f"answer about state {state}")
    if not len(shown):
        # No label takes this number, and the next run gets the next one there is.
        return [Answered(state, DONE, _SILENT + len(session.state.asked), 0)]
    return [Answered(s, a, number, step) for step, (s, a) in enumerate(shown.pairs)]


def _advice(session: NetworkSession, expert: Expert) -> list[Event]:
    """What an expert says of a cluster, if one is left to ask about."""
    asked = session.propose_cluster()
    if asked is None:
        return []
    answer = expert.advise(asked, session.state.clusters[asked])
    cluster = asked if answer.cluster is None else answer.cluster
    said = Advised(cluster, "", sorted(answer.preferred), sorted(answer.avoided))
    return [said] if cluster == asked else [Advised(asked, "", [], []), said]
