"""The same loop as users of python-control and of jitcdde would write it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import control
import numpy as np
import symengine
from jitcdde import jitcdde, t, y
from jitcxde_common import conditional

from design.blocks.block import Block, plant_block
from design.blocks.state_space import realize
from design.design_file import Design
from experiments.engine.saturated_loop import SaturatedLoop
from experiments.thesis.printed_choices import thesis_reference

Peer = Callable[[], np.ndarray]

SAID_OF_JITCDDE = "rtol = atol = 1e-8, smooth conditional of width 1.2e-4"


def pade_response(design: Design, limit: float, time_s: np.ndarray, tolerance: float) -> Peer:
    """The output of Fig. 2.6 by python-control: a system a block, second-order Pade, interconnected."""
    plant = design.loop_plant
    forward, feedback = design.controller_parts()
    anti_windup = design.compensator("thesis")
    reference = thesis_reference("extended", design.reference_omegas)

    def system(name: str, inputs: str, outputs: Sequence[str], *blocks: Block) -> control.StateSpace:
        part = realize(*blocks)  # its own conversion of a transfer function loses digits on these polynomials
        return control.ss(
            part.A, part.b[:, None], part.C, part.d[:, None], name=name, inputs=inputs, outputs=list(outputs)
        )

    def dead_time(name: str, inputs: str, outputs: str) -> control.StateSpace:
        late = control.tf(*control.pade(plant.delay_s, 2))
        return control.ss(late, name=name, inputs=inputs, outputs=outputs)

    def saturation(_t: float, _x: np.ndarray, u: np.ndarray, _params: object) -> np.ndarray:
        return np.clip(u, -limit, limit)

    loop = control.interconnect(
        [
            system("P", "u_m", ["y_ahead"], plant_block(plant)),
            dead_time("delay_of_P", "y_ahead", "y"),
            system("theta", "u_tilde", ["a", "y_d_ahead"], anti_windup.theta1_tilde, anti_windup.theta2(plant)),
            dead_time("delay_of_theta2", "y_d_ahead", "y_d"),
            system("K", "e", ["k"], forward),
            system("T_so", "v", ["v_ahead"], feedback),
            dead_time("delay_of_T_so", "v_ahead", "v_late"),
            control.nlsys(None, saturation, name="sat", inputs="u", outputs="u_m"),
            control.summing_junction(["r", "-y", "-y_d"], "e"),
            control.summing_junction(["k", "v_late"], "v"),
            control.summing_junction(["v", "-a"], "u"),
            control.summing_junction(["u", "-u_m"], "u_tilde"),
        ],
        inputs="r",
        outputs="y",
    )
    options = {"rtol": tolerance, "atol": tolerance}

    def run() -> np.ndarray:
        response = control.input_output_response(loop, time_s, reference(time_s), solve_ivp_kwargs=options)
        return np.asarray(response.outputs).reshape(len(time_s))

    return run


def collapsed_response(loop: SaturatedLoop, limit: float, time_s: np.ndarray, tolerance: float) -> Peer:
    """The output of a loop without dead times by python-control, its right side one function of all states."""
    row, _ = loop.outputs["output"]

    def update(_t: float, x: np.ndarray, _u: np.ndarray, _params: object) -> np.ndarray:
        return loop.A @ x + loop.B * np.clip(loop.C @ x, -limit, limit)

    system = control.nlsys(update, None, inputs=0, outputs=None, states=len(loop.x0))
    options = {"rtol": tolerance, "atol": tolerance}

    def run() -> np.ndarray:
        response = control.input_output_response(system, time_s, X0=loop.x0, solve_ivp_kwargs=options)
        return np.asarray(row @ response.states)

    return run


def jitcdde_run(loop: SaturatedLoop, limit: float, time_s: np.ndarray, tolerance: float) -> tuple[Peer, float]:
    """What the first dead time delays, by jitcdde with its exact dead times; and the seconds it took to compile.

    The saturation is jitcdde's own smooth ``conditional``, nested; the start is the discontinuity that
    ``step_on_discontinuities`` steps on, as its documentation recommends. The sample times begin after that, later than
    one dead time.
    """
    n, k = len(loop.x0), len(loop.delays)
    states = [y(i) for i in range(n)]
    w, (u, m) = symengine.symbols(f"w:{k}"), symengine.symbols("u m")

    def dot(row: np.ndarray, values: Sequence[symengine.Expr]) -> symengine.Expr:
        pairs = zip(row, values, strict=True)
        return sum((float(factor) * value for factor, value in pairs if factor), start=symengine.Integer(0))

    late = [[y(i, t - float(delay)) for i in range(n)] for delay in loop.delays]
    helpers = [(w[j], dot(loop.Z[j], late[j])) for j in range(k)]
    helpers.append((u, dot(loop.C, states) + dot(loop.E, w)))
    helpers.append((m, conditional(u, -limit, -limit, conditional(u, limit, u, limit))))
    equations = [dot(loop.A[i], states) + float(loop.B[i]) * m + dot(loop.D[i], w) for i in range(n)]
    start = time.perf_counter()
    solver = jitcdde(equations, helpers=helpers, n=n, max_delay=float(loop.delays.max()), verbose=False)
    solver.compile_C()
    compiled = time.perf_counter() - start
    # with its default first and least steps it gives up at the first kink
    solver.set_integration_parameters(rtol=tolerance, atol=tolerance, first_step=1e-4, min_step=1e-14)

    def run() -> np.ndarray:
        solver.purge_past()
        solver.constant_past(loop.x0)
        solver.reset_integrator()
        solver.step_on_discontinuities()
        return np.array([solver.integrate(at) for at in time_s]) @ loop.Z[0]

    return run, compiled
