# SPDX-License-Identifier: Apache-2.0
"""Measures from a box to a cupboard over ten scans: how far it is, how well one scan tells it, and how well their scatter says so."""
import statistics

import striper

SCENE = "data/scenes/room.yaml"


def main() -> None:
    model = striper.simulated_model(SCENE)
    measurer = striper.Measurer(["depth:step:x=0.5..0.7,y=-0.1..0.1;x=1.9..2.1,y=-0.8..-0.4"], model)
    values = []
    for scan in striper.scan(f"sim:{SCENE}?frames=10&seed=7", model=model):
        for row in measurer.measure(scan):
            if row.status != "ok":
                print(f"scan {scan.frame}: {row.tool}: {row.status}")
                continue
            values.append(row.value)
            print(f"scan {scan.frame}: {1e3 * row.value:.2f} mm +- {1e3 * row.sigma:.2f} of {row.points} returns")
    if len(values) > 1:
        print(f"scatter of {len(values)} scans: {1e3 * statistics.stdev(values):.2f} mm")


if __name__ == "__main__":
    main()
