# SPDX-License-Identifier: Apache-2.0
"""Draws a scan with its error bars and straight pieces: 02_plot.py [OUT.png]"""
import sys

import matplotlib.pyplot as plt

import striper

SCENE = "data/scenes/room.yaml"


def main() -> None:
    scan = next(iter(striper.scan(f"sim:{SCENE}", model=striper.simulated_model(SCENE))))
    ok = scan.returns[scan.returns["status"] == striper.Status.OK]
    figure, axes = plt.subplots(figsize=(7, 6))
    axes.errorbar(ok["y_m"], ok["x_m"], yerr=ok["sigma_m"], fmt=".", markersize=3, label="returns, one sigma")
    for number, piece in enumerate(striper.segments(scan).pieces):
        (x0, y0), (x1, y1) = piece.begin_m, piece.end_m
        axes.plot([y0, y1], [x0, x1], "k-", linewidth=1, label="straight pieces" if number == 0 else None)
    axes.set_xlabel("y, left (m)")
    axes.set_ylabel("x, forward (m)")
    axes.invert_xaxis()
    axes.set_aspect("equal")
    axes.legend()
    name = sys.argv[1] if len(sys.argv) > 1 else "scan.png"
    figure.savefig(name, dpi=120)
    print(f"wrote {name}: {len(ok)} returns")


if __name__ == "__main__":
    main()
