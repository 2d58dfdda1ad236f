"""One picture of several methods on one or more tasks: how good, and how long it took."""

from collections.abc import Sequence

from matplotlib.figure import Figure


def plot_methods(
    figure: Figure,
    methods: Sequence[str],
    panels: Sequence[tuple[str, Sequence[float]]],
    ceilings: Sequence[float],
    seconds: Sequence[float],
) -> None:
    """Draw a bar per method and panel, and the seconds that learning took.

    Args:
        figure: to draw on.
        methods: names, from top to bottom.
        panels: title and value of each method.
        ceilings: of each panel: what the demonstrator or the true reward's policy gets.
        seconds: of each method, all panels together.
    """
    figure.set_size_inches(3.4 * (len(panels) + 1), 0.35 * len(methods) + 1.3)
    axes = figure.subplots(1, len(panels) + 1, sharey=True)
    for axis, (title, values), ceiling in zip(axes, panels, ceilings, strict=False):
        axis.barh(methods, values, color="#4393c3")
        axis.axvline(ceiling, color="k", lw=1, ls=":")
        axis.set_title(title, fontsize=10)
        axis.grid(axis="x", alpha=0.3)
    axes[-1].barh(methods, seconds, color="#bababa")
    axes[-1].set_xscale("log")
    axes[-1].set_title("seconds to learn", fontsize=10)
    axes[-1].grid(axis="x", alpha=0.3)
    axes[0].invert_yaxis()
