# SPDX-License-Identifier: Apache-2.0
"""Calibrates from images and writes striper.yaml: 03_calibrate.py [IMAGES BOARD SQUARE_M]"""
import sys

import striper


def main() -> None:
    images, board, square = sys.argv[1:4] if len(sys.argv) > 3 else ("data/calibration/*.png", "9x6", "0.06")
    result = striper.calibrate(lasers=images, board=board, square=float(square))
    for finding in result.findings:
        print(f"{finding.severity}: {finding.message}\n    {finding.advice}")
    print(result.verdict)
    if not result.refused:
        result.model.save("striper.yaml")
        print("wrote striper.yaml")


if __name__ == "__main__":
    main()
