# SPDX-License-Identifier: Apache-2.0
"""Prints the nearest range of every scan: 01_stream.py [SOURCE [MODEL]]"""
import sys

import striper

SCENE = "data/scenes/room.yaml"


def main() -> None:
    source = sys.argv[1] if len(sys.argv) > 1 else f"sim:{SCENE}?frames=5"
    model: striper.Model | str = sys.argv[2] if len(sys.argv) > 2 else striper.simulated_model(SCENE)
    for scan in striper.scan(source, model=model):
        returns = scan.returns[scan.returns["status"] == striper.Status.OK]
        if len(returns) == 0:
            print(f"{scan.time:.3f} s: nothing")
            continue
        nearest = returns[returns["range_m"].argmin()]
        print(f"{scan.time:.3f} s: {nearest['range_m']:.4f} m +- {1e3 * nearest['sigma_m']:.2f} mm")


if __name__ == "__main__":
    main()
