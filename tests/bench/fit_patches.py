#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fits the network that looks at the image about a return: sdk/src/stripe/report/patches/patch_net.inc.

    fit_patches.py OUT.inc EPOCHS ROWS... [--check ROWS...]
    fit_patches.py OUT.inc 0

The second writes one that says nothing.

ROWS is what `choice_training patches ROWS ...` wrote: ROWS.patches, ROWS.returns, ROWS.evidence. `--check` names what the network does not
learn from: how much of what it says is believed is chosen on that, and then printed what it is worth there. Needs torch (Debian's
python3-torch) and numpy. A million returns and an epoch take four minutes of a core. The layers are those of patch_net.cpp.
"""

import argparse
import pathlib
import sys

import numpy as np
import torch
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits

from weights_file import dense, write_weights

SIDE = 32
PLANES = 3
SEEN = 32
HIDDEN = 48
MOST_EVIDENCE = 16.0
SURE = float(np.log(99.0))
RETURN = np.dtype([("patch", "u4"), ("is_right", "u1"), ("is_known", "u1"), ("unused", "u2"), ("odds", "f4"), ("along", "f4"),
                   ("across", "f4"), ("fraction", "f4")])
EVIDENCE = 112


class Returns:
    """Returns that were doubted, the patches about them, and what else is known of them."""

    def __init__(self, paths):
        patches, returns, evidence, before = [], [], [], 0
        for path in paths:
            path = path.removesuffix(".returns")
            patches.append(np.fromfile(f"{path}.patches", np.float16).reshape(-1, PLANES, SIDE, SIDE))
            rows = np.fromfile(f"{path}.returns", RETURN)
            evidence.append(np.fromfile(f"{path}.evidence", np.float32).reshape(len(rows), EVIDENCE))
            rows["patch"] += before
            before += len(patches[-1])
            returns.append(rows)
        self.patches = np.concatenate(patches)
        rows = np.concatenate(returns)
        known = rows["is_known"] == 1
        self.rows = rows[known]
        self.evidence = np.clip(np.concatenate(evidence)[known], -MOST_EVIDENCE, MOST_EVIDENCE)
        self.odds = torch.from_numpy(self.rows["odds"].copy())
        self.is_right = torch.from_numpy(self.rows["is_right"].astype(np.float32))

    def __len__(self):
        return len(self.rows)

    def batch(self, which, mirrored=(False, False)):
        """The patches of some returns, which of them each has, what else is known, and how they were rated."""
        rows = self.rows[which]
        used, of_each = np.unique(rows["patch"], return_inverse=True)
        patch = torch.from_numpy(self.patches[used]).float().to(memory_format=torch.channels_last)
        place = np.stack([rows["along"] / 4, rows["across"] / 3, rows["fraction"]], 1)
        # About the return, which is the first pixel of the second half. The few kinds of evidence that have a direction stay as they are.
        for axis, columns in ((2, [1, 2]), (3, [0])):
            if mirrored[axis - 2]:
                patch = torch.roll(torch.flip(patch, [axis]), 1, axis)
                patch.select(axis, 0).zero_()
                place[:, columns] *= -1
        known = np.concatenate([self.evidence[which], rows["odds"][:, None] / 3, place], 1)
        return patch, torch.from_numpy(of_each), torch.from_numpy(known.astype(np.float32)), self.odds[which]


class PatchNet(nn.Module):
    def __init__(self, known_mean, known_spread):
        super().__init__()
        self.mean, self.spread = known_mean, known_spread

        def filters(inputs, outputs):
            return [nn.Conv2d(inputs, outputs, 3, padding=1), nn.ReLU(), nn.MaxPool2d(2)]

        self.look = nn.Sequential(*filters(PLANES, 8), *filters(8, 16), *filters(16, 16), nn.Flatten(), nn.Dropout(0.1),
                                  nn.Linear(16 * (SIDE // 8) ** 2, SEEN), nn.ReLU())
        self.know = nn.Sequential(nn.Linear(len(known_mean), HIDDEN), nn.ReLU())
        self.both = nn.Sequential(nn.Linear(SEEN + HIDDEN, HIDDEN), nn.ReLU(), nn.Dropout(0.1), nn.Linear(HIDDEN, 1))
        nn.init.zeros_(self.both[3].weight)
        nn.init.zeros_(self.both[3].bias)

    def forward(self, patches, of_each, known, odds):
        known = self.know((known - self.mean) / self.spread)
        return odds + self.both(torch.cat([self.look(patches)[of_each], known], 1))[:, 0]


def log_odds_of(net, returns, together=1024):
    net.eval()
    with torch.no_grad():
        parts = [net(*returns.batch(np.arange(i, min(i + together, len(returns))))) for i in range(0, len(returns), together)]
    net.train()
    return torch.cat(parts)


def say(net, returns, what):
    after = log_odds_of(net, returns)
    for word, odds in (("before", returns.odds), ("after ", after)):
        loss = binary_cross_entropy_with_logits(odds, returns.is_right).item()
        sure = odds >= SURE
        right = (sure & (returns.is_right == 1)).sum().item()
        wrong = (sure & (returns.is_right == 0)).sum().item()
        print(f"{what} {word}: log loss {loss:.4f}; of {len(returns)} doubted returns {right} sure and right, {wrong} sure and wrong",
              flush=True)


def fit(returns, check, epochs, together=256, rate=1.5e-3, warming=500):
    _, _, known, _ = returns.batch(np.arange(len(returns))[:: max(1, len(returns) // 50000)])
    # What hardly changes where it is learnt from may change more elsewhere.
    net = PatchNet(known.mean(0), known.std(0).clamp(min=0.1)).to(memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(net.parameters(), rate, weight_decay=1e-3)
    dice = np.random.default_rng(1)
    steps = int(epochs * len(returns) / together)
    order = np.concatenate([dice.permutation(len(returns)) for _ in range(int(np.ceil(epochs)))])
    running = 0.0
    for step in range(steps):
        for group in optimizer.param_groups:
            group["lr"] = rate * min(1.0, (step + 1) / warming) * 0.5 * (1.0 + np.cos(np.pi * step / steps))
        which = order[step * together : (step + 1) * together]
        odds = net(*returns.batch(which, dice.integers(0, 2, 2).astype(bool)))
        loss = binary_cross_entropy_with_logits(odds, returns.is_right[which])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        running = loss.item() if step == 0 else 0.998 * running + 0.002 * loss.item()
        if step % 1000 == 999:
            print(f"step {step + 1} of {steps}: log loss {running:.4f}", flush=True)
        if step % 4000 == 3999:
            for returns_checked in check:
                say(net, returns_checked, "checked")
    return net


def believe(net, check):
    """Leaves as much of what the network says as others than those that it learnt from bear out: a part of its log odds."""
    before = torch.cat([returns.odds for returns in check])
    says = torch.cat([log_odds_of(net, returns) for returns in check]) - before
    is_right = torch.cat([returns.is_right for returns in check])
    parts = np.arange(0.3, 1.001, 0.025)
    losses = [binary_cross_entropy_with_logits(before + part * says, is_right).item() for part in parts]
    part = float(parts[int(np.argmin(losses))])
    print(f"of what it says {part:.3f} is believed", flush=True)
    with torch.no_grad():
        net.both[3].weight *= part
        net.both[3].bias *= part


def write(net, out):
    """Weights in the order of patch_net.cpp, with the known values' scale in theirs."""
    def conv(layer):
        w = layer.weight.detach().numpy()  # outputs, inputs, down, right
        outputs, inputs = w.shape[:2]
        return w.reshape(outputs // 4, 4, inputs, 3, 3).transpose(0, 2, 3, 4, 1), layer.bias.detach().numpy()

    known_w, known_b = dense(net.know[0])
    mean, spread = net.mean.numpy(), net.spread.numpy()
    known_b = known_b - (mean / spread) @ known_w
    known_w = known_w / spread[:, None]
    last_w, last_b = dense(net.both[3])
    layers = {}
    for name, (weights, biases) in {"First": conv(net.look[0]), "Second": conv(net.look[3]), "Third": conv(net.look[6]),
                                    "Seen": dense(net.look[11]), "Known": (known_w, known_b), "Both": dense(net.both[0])}.items():
        layers[name + "Weights"], layers[name + "Biases"] = weights, biases
    layers["LastWeights"], layers["LastBias"] = last_w, last_b[0]
    write_weights(out, "fit_patches.py", layers)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("epochs", type=float)
    parser.add_argument("rows", nargs="*")
    parser.add_argument("--check", nargs="+", default=[])
    arguments = parser.parse_args()
    torch.manual_seed(1)
    torch.set_num_threads(2)
    if arguments.epochs == 0:
        known = EVIDENCE + 4
        return write(PatchNet(torch.zeros(known), torch.ones(known)), arguments.out)
    if not arguments.rows:
        parser.error("no ROWS to learn from")
    check = [Returns([path]) for path in arguments.check]
    returns = Returns(arguments.rows)
    print(f"{len(returns)} returns, {len(returns.patches)} patches", flush=True)
    net = fit(returns, check, arguments.epochs)
    if check:
        believe(net, check)
    for path, returns_checked in zip(arguments.check, check):
        say(net, returns_checked, pathlib.Path(path).name)
    write(net, arguments.out)


if __name__ == "__main__":
    sys.exit(main())
