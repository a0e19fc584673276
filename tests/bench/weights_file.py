# SPDX-License-Identifier: Apache-2.0
"""Weights of a network as constants of C++: NAME.inc, which a source file includes."""

import pathlib

import numpy as np

IN_A_LINE = 12


def write_weights(path, written_by, layers):
    """layers: the constants' names without `k`, and their values: arrays, or single numbers."""
    lines = ["// SPDX-License-Identifier: Apache-2.0", f"// Written by tests/bench/{written_by}.", "// clang-format off"]
    for name, values in layers.items():
        if np.ndim(values) == 0:
            lines.append(f"inline constexpr float k{name} = {float(values):.7f}F;")
            continue
        numbers = [f"{v:.5g}" for v in np.asarray(values).ravel()]
        numbers = [n if "." in n or "e" in n else n + "." for n in numbers]
        lines.append(f"inline constexpr float k{name}[] = {{")
        lines += [",".join(n + "F" for n in numbers[i : i + IN_A_LINE]) + "," for i in range(0, len(numbers), IN_A_LINE)]
        lines.append("};")
    lines.append("// clang-format on")
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def dense(layer):
    """A linear layer's weights, of each input those of all outputs, and its biases."""
    return layer.weight.detach().numpy().T, layer.bias.detach().numpy()
