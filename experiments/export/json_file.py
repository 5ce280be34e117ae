"""A controller as JSON: its difference equations, for whoever writes them in a language of his own."""

from __future__ import annotations

import json
import math
from typing import Any

from experiments.drive.difference_equations import SampledBlock
from experiments.export.check_run import CheckRun
from experiments.export.controller import SampledController

SCHEMA = 1
STEP = (
    "e = reference - measurement - memory(windup, 2)",
    "v = (forward.C[1] x_forward + forward.d[1] e + sum over o of memory(feedback, o)) / (1 - around)",
    "u_0 = v - windup.C[1] x_windup",
    "u_tilde = (u_0 - sat(u_0)) / (1 + windup.d[1] + through)",
    "v = v - through u_tilde; e = e - direct u_tilde; u = u_0 - (windup.d[1] + through) u_tilde",
    "command = sat(u)",
    "forward takes e, feedback takes v, windup takes u_tilde: x = A x + b input",
)
MEMORY = (
    "memory(block, o) = sum over j of block.memories[o].taps[j] p_o[k - block.memories[o].first - j], "
    "p_o[i] = block.C[o] x[i] + block.d[o] input[i], 0 before the first sample; of p_o[k] itself only C[o] x counts"
)


def files(controller: SampledController, run: CheckRun) -> dict[str, str]:
    """The files by their names: NAME.json, whose keys docs/how_to/export.md explains, and NAME_test.csv."""
    standing = controller.standing
    low, high = (limit if math.isfinite(limit) else None for limit in controller.limits)
    content = {
        "schema": SCHEMA,
        "name": controller.name,
        "promise": controller.promise,
        "rate_hz": controller.rate_hz,
        "method": controller.method,
        "anti_windup": controller.anti_windup,
        "signals": controller.signals.to_dict(),
        "limits": {"low": low, "high": high},
        "step": list(STEP),
        "memory": MEMORY,
        "forward": _block(controller.forward),
        "feedback": _block(controller.feedback),
        "windup": _block(controller.theta),
        "around": controller.around,
        "direct": controller.direct,
        "through": controller.through,
        "start": {
            "forward": standing.forward.tolist(),
            "slowest": None if standing.slowest is None else standing.slowest.tolist(),
            "feedback": standing.feedback.tolist(),
            "memories": standing.memories.tolist(),
        },
    }
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    return {f"{controller.name}.json": text, f"{controller.name}_test.csv": run.csv()}


def _block(block: SampledBlock) -> dict[str, Any]:
    taps = zip(block.first.tolist(), block.length.tolist(), block.taps.tolist(), strict=True)
    return {
        "A": block.A.tolist(),
        "b": block.b.tolist(),
        "C": block.C.tolist(),
        "d": block.d.tolist(),
        "memories": [{"first": first, "taps": row[:length]} for first, length, row in taps],
    }
