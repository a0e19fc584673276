# SPDX-License-Identifier: Apache-2.0
"""Frames, controls, models, the simulator, profiles and calibration from Python."""
import numpy as np
import pytest
import striper

from conftest import ROOT, assert_same_returns

ROOM = ROOT / "data" / "scenes" / "room.yaml"


def test_frames_show_their_pixels(session):
    with striper.open_source(f"sim:{ROOM}?frames=3") as source:
        frames = list(source)
    assert [frame.sequence for frame in frames] == [0, 1, 2]
    image = frames[0].image
    assert image.dtype == np.uint8 and image.shape == (source.info.height, source.info.width)
    assert not image.flags.writeable
    kept = image.copy()
    del frames
    assert np.array_equal(image, kept)
    again = list(source)
    assert np.array_equal(again[0].image, kept), "a file starts again"


def test_a_frame_of_an_array_is_scanned():
    with striper.open_source(f"sim:{ROOM}?frames=1") as source:
        given = next(source)
    own = striper.Frame(given.image, sequence=7, time=1.5)
    assert np.array_equal(own.image, given.image) and own.sequence == 7 and own.time == 1.5
    model = striper.simulated_model(ROOM)
    scan = striper.Scanner(model, source.info).process(own)
    assert [s.frame for s in scan] == [7]


def test_controls_are_set_and_read_back():
    with striper.open_source(f"sim:{ROOM}") as source:
        names = [control.name for control in source.controls()]
        assert "exposure_us" in names and "laser" in names
        bright = next(source).image.max()
        assert source.set("laser", False).value is False
        assert next(source).image.max() < bright
        with pytest.raises(striper.Error) as error:
            source.set("exposure_us", -1.0)
        assert error.value.kind == "bad_value"


def test_a_model_is_read_and_written(tmp_path):
    model = striper.simulated_model(ROOM)
    model.save(tmp_path / "striper.yaml")
    again = striper.load_model(tmp_path / "striper.yaml")
    assert again.to_yaml() == model.to_yaml()
    assert np.array_equal(again.camera.matrix, model.camera.matrix)
    ray = model.camera.unproject([100.0, 50.0])
    assert np.allclose(model.camera.project([ray[0], ray[1], 1.0]), [100.0, 50.0], atol=1e-9)
    assert abs(np.linalg.norm(again.lasers[0].normal) - 1.0) < 1e-9
    assert again.T_cam_scan().shape == (4, 4)


def test_simulated_truth_is_where_the_scan_says():
    model = striper.simulated_model(ROOM)
    scanner = striper.Scanner(model, striper.open_source(f"sim:{ROOM}").info)
    errors = []
    for frame, truth in striper.simulate(ROOM, 3):
        lines = truth.lines
        assert len(lines) == frame.image.shape[1] == len(truth.status)
        for scan in scanner.process(frame):
            ok = (scan.returns["status"] == striper.Status.OK) & lines["visible"] & ~lines["near_edge"]
            errors.append((scan.returns["range_m"] - lines["range_m"])[ok] / scan.returns["sigma_m"][ok])
    errors = np.concatenate(errors)
    assert len(errors) > 500
    assert 0.8 < np.sqrt(np.median(errors**2) / 0.4549) < 1.25


def test_dark_exposures_have_no_truth():
    truths = [truth for _, truth in striper.simulate(f"{ROOM}?laser=0,dark", 4)]
    assert [truth is None for truth in truths] == [False, True, False, True]


def wall():
    scene = ROOT / "data" / "scenes" / "wall.yaml"
    return next(iter(striper.scan(f"sim:{scene}", model=striper.simulated_model(scene))))


def test_pieces_smoothing_and_measurements():
    scan = wall()
    segmentation = striper.segments(scan)
    assert len(segmentation.joints) == len(segmentation.pieces) - 1
    longest = max(segmentation.pieces, key=lambda piece: piece.points)
    assert longest.points > 100 and longest.circle is None and longest.line.covariance.shape == (2, 2)
    before = scan.returns.copy()
    smooth = striper.smooth(scan)
    assert_same_returns(scan.returns, before)  # The scan itself stays.
    ok = smooth.returns["status"] == striper.Status.OK
    assert np.median(smooth.returns["sigma_m"][ok]) < 0.5 * np.median(before["sigma_m"][ok])
    rows = striper.measure(scan, "wall:line")
    assert [row.tool for row in rows] == striper.Measurer(["wall:line"]).rows
    distance = next(row for row in rows if row.tool.endswith("distance"))
    assert distance.status == "ok" and abs(distance.value - longest.line.distance_m) < 5.0 * distance.sigma
    with pytest.raises(striper.Error):
        striper.measure(scan, "wall:volume")


def test_a_curb_is_found():
    scene = ROOT / "data" / "scenes" / "curb.yaml"
    scan = striper.scan(f"sim:{scene}", model=striper.simulated_model(scene)).next()
    (curb,) = [finding for finding in striper.find_curbs(scan) if finding.probability > 0.5]
    assert abs(curb.height_m - 0.15) < 5.0 * curb.sigma_height_m + 1e-3
    assert abs(sum(curb.posterior.values()) - 1.0) < 1e-6


def test_curbs_and_objects_are_followed():
    scene = ROOT / "data" / "scenes" / "curb.yaml"
    model = striper.simulated_model(scene)
    detector = striper.CurbDetector(up_rad=np.radians(118), model=model)
    tracker = striper.ObjectTracker(up_rad=np.radians(118))
    for k, scan in zip(range(6), striper.scan(f"sim:{scene}", model=model)):
        motion = striper.Motion(distance_m=0.4 * k, speed_m_s=12.0)
        curbs = detector.update(scan, motion)
        objects = tracker.update(scan, motion)
    (curb,) = [one for one in curbs if one.confidence > 0.9]
    assert (curb.kind, curb.state, curb.hits, curb.id) == ("up", "tracked", 6, 1)
    assert abs(curb.lateral_m - 1.2) < 5.0 * curb.sigma_lateral_m and abs(curb.height_m - 0.15) < 2e-3
    assert abs(curb.way_m - 2.0) < 1e-9 and np.isnan(curb.sigma_cal_lateral_m)  # No covariance.
    assert all(0.0 <= one.confidence <= 1.0 for one in objects)
    with pytest.raises(striper.Error):
        striper.CurbDetector(min_height_m=0.5)


def test_an_object_comes_closer(tmp_path):
    lines = ["frame,time_s,bearing_rad,range_m,sigma_m"]
    for k in range(5):
        distance = 3.0 - 0.2 * k
        for bearing in np.linspace(-0.1, 0.1, 41):
            lines.append(f"{k},{0.05 * k},{bearing},{distance / np.cos(bearing)},0.002")
    table = tmp_path / "scans.csv"
    table.write_text("\n".join(lines) + "\n")
    tracker = striper.ObjectTracker(roughness_m=0.001)
    for scan in striper.scan(table):
        (track,) = tracker.update(scan)
    assert track.is_seen and track.hits == 5 and track.zone == "unknown"
    assert abs(track.closing_m_s - 4.0) < 4.0 * track.sigma_closing_m_s + 0.01
    assert track.ttc_low_s < track.time_to_contact_s < track.ttc_high_s
    assert abs(track.position_m[0] - 2.2) < 0.01


def test_a_design_has_figures():
    design = striper.StriperDesign(striper.simulated_model(ROOM))
    design.camera.rate_hz = 60.0
    figures = striper.DesignFigures(design)
    near, far = figures.at(1.0), figures.at(2.0)
    assert 0.0 < near.step_out_m < far.step_out_m
    assert near.snr > far.snr > 0.0
    assert figures.scan_rate_hz == 60.0
    design.reflectance = 2.0
    with pytest.raises(striper.Error, match="reflectance"):
        striper.DesignFigures(design)


def test_calibration_finds_the_striper():
    folder = ROOT / "data" / "calibration"
    stages = []
    result = striper.calibrate(
        lasers=folder / "*.png", board="9x6", square=0.06, progress=lambda stage, part: stages.append(part)
    )
    assert not result.refused, result.verdict
    assert stages and all(0.0 <= part <= 1.0 for part in stages)
    truth = striper.load_model(folder / "truth.yaml")
    assert abs(result.model.camera.matrix[0, 0] / truth.camera.matrix[0, 0] - 1.0) < 0.01
    names, covariance = result.model.covariance
    assert covariance.shape == (len(names), len(names))


def test_what_progress_raises_ends_a_calibration():
    def progress(stage, part):
        raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        striper.calibrate(lasers=ROOT / "data" / "calibration", board="9x6", square=0.06, progress=progress)


def test_calibration_says_what_is_missing():
    with pytest.raises(striper.Error, match="no images"):
        striper.calibrate(board="9x6", square=0.06)
