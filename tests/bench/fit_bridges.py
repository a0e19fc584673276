#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fits the networks that rate what was measured in gaps between sure returns: sdk/src/stripe/track/bridge_rating.inc.

    fit_bridges.py OUT.inc EPOCHS ROWS... [--check ROWS...]
    fit_bridges.py OUT.inc 0

The second writes some by which nothing is probable.

ROWS is what `choice_training bridges ROWS ...` wrote. First the networks learn from four fifths of it, and what they say
together of the rest is compared with what is right there: odds that are learnt by heart are too high, and all are scaled by
what makes them most probable. Then they learn from all. `--check` names what they do not learn from: for these it prints
what they say and how much is right. Needs torch (Debian's python3-torch) and numpy; ten epochs of 150 000 rows take a minute.
"""

import argparse
import pathlib
import sys

import numpy as np
import torch
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits

from weights_file import dense, write_weights

EVIDENCE = 49
HIDDEN = 64
NETS = 5
NEVER = -10.0
TAKEN_ODDS = np.log(0.9925 / 0.0075)


def read(paths):
    """Evidence, what is right, and whether it is of the last fifth of its file: of other scenes, but for one."""
    files = [np.fromfile(path, np.float32).reshape(-1, EVIDENCE + 1) for path in paths]
    last = np.concatenate([np.arange(len(file)) >= 0.8 * len(file) for file in files])
    rows = np.concatenate(files)
    return torch.from_numpy(rows[:, :EVIDENCE]), torch.from_numpy(rows[:, EVIDENCE]), torch.from_numpy(last)


class BridgeNet(nn.Module):
    def __init__(self, mean, spread):
        super().__init__()
        self.mean, self.spread = mean, spread
        self.layers = nn.Sequential(nn.Linear(EVIDENCE, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, 1))

    def forward(self, evidence):
        return self.layers((evidence - self.mean) / self.spread)[:, 0]


class Mean(nn.Module):
    def __init__(self, nets):
        super().__init__()
        self.nets = nn.ModuleList(nets)

    def forward(self, evidence):
        return torch.stack([net(evidence) for net in self.nets]).mean(0)


def fit(evidence, is_right, epochs, together=256, rate=3e-3):
    net = BridgeNet(evidence.mean(0), evidence.std(0).clamp(min=0.01))
    optimizer = torch.optim.AdamW(net.parameters(), rate, weight_decay=3e-1)
    steps = int(epochs * len(is_right) / together)
    for step in range(steps):
        for group in optimizer.param_groups:
            group["lr"] = rate * 0.5 * (1.0 + np.cos(np.pi * step / steps))
        which = torch.randint(len(is_right), (together,))
        loss = binary_cross_entropy_with_logits(net(evidence[which]), is_right[which])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return net


def fit_all(evidence, is_right, epochs):
    nets = []
    for seed in range(NETS):
        torch.manual_seed(seed)
        nets.append(fit(evidence, is_right, epochs))
    return nets


def scale_of(nets, evidence, is_right):
    with torch.no_grad():
        odds = Mean(nets)(evidence)
    scales = np.linspace(0.4, 1.2, 81)
    losses = [binary_cross_entropy_with_logits(scale * odds, is_right).item() for scale in scales]
    scale = scales[np.argmin(losses)]
    is_taken = scale * odds >= TAKEN_ODDS
    print(f"the last fifths: log loss {min(losses):.4f}, odds scaled by {scale:.2f}; {int(is_taken.sum())} taken, "
          f"{100 * is_right[is_taken].mean():.2f} % right", flush=True)
    return scale


def scaled(net, scale):
    with torch.no_grad():
        net.layers[4].weight *= scale
        net.layers[4].bias *= scale
    return net


def say(net, path):
    evidence, is_right, _ = read([path])
    with torch.no_grad():
        odds = net(evidence)
    said = torch.sigmoid(odds)
    print(f"{pathlib.Path(path).name}: {len(said)} rows, log loss {binary_cross_entropy_with_logits(odds, is_right).item():.4f}")
    for low, high in ((0.0, 0.5), (0.5, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 0.995), (0.995, 0.999), (0.999, 1.1)):
        here = (said >= low) & (said < high)
        if here.any():
            print(f"  {low:.3f} to {min(high, 1.0):.3f}: {int(here.sum())}, {int(is_right[here].sum())} right: "
                  f"{100 * is_right[here].mean():.2f} %, said {100 * said[here].mean():.2f} %")


def write(nets, out):
    """Net by net, with the scale of the evidence in the first weights."""
    layers = {name: [] for name in ("FirstWeights", "FirstBiases", "SecondWeights", "SecondBiases", "LastWeights", "LastBiases")}
    for net in nets:
        first_w, first_b = dense(net.layers[0])
        mean, spread = net.mean.numpy(), net.spread.numpy()
        first = (first_w / spread[:, None], first_b - (mean / spread) @ first_w)
        for name, values in zip(layers, (*first, *dense(net.layers[2]), *dense(net.layers[4]))):
            layers[name] += list(np.asarray(values).ravel())
    write_weights(out, "fit_bridges.py", layers)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("epochs", type=float)
    parser.add_argument("rows", nargs="*")
    parser.add_argument("--check", nargs="+", default=[])
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    if arguments.epochs == 0:
        torch.manual_seed(0)
        net = BridgeNet(torch.zeros(EVIDENCE), torch.ones(EVIDENCE))
        with torch.no_grad():
            net.layers[4].weight.zero_()
            net.layers[4].bias.fill_(NEVER)
        return write([net] * NETS, arguments.out)
    if not arguments.rows:
        parser.error("no ROWS to learn from")
    evidence, is_right, last = read(arguments.rows)
    print(f"{len(is_right)} rows, {100 * is_right.mean():.1f} % right", flush=True)
    first = fit_all(evidence[~last], is_right[~last], arguments.epochs)
    scale = scale_of(first, evidence[last], is_right[last])
    nets = [scaled(net, scale) for net in fit_all(evidence, is_right, arguments.epochs)]
    for path in arguments.check:
        say(Mean(nets), path)
    write(nets, arguments.out)


if __name__ == "__main__":
    sys.exit(main())
