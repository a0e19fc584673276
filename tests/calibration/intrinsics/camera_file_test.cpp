// SPDX-License-Identifier: Apache-2.0
// Proves that a camera is read from each kind of file that holds one, that what we write for ROS is
// read back to the same camera, and that a file without a camera, or with one that no lens of ours
// is, is refused naming file and field.
#include <gmock/gmock.h>

#include <striper/adjust/solve_joint.hpp>
#include <striper/core/error.hpp>
#include <striper/intrinsics/camera_file.hpp>
#include <striper/model/model_yaml.hpp>

#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRos = R"(image_width: 640
image_height: 480
camera_name: left
camera_matrix: {rows: 3, cols: 3, data: [610.5, 0, 318.25, 0, 402.125, 241.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.25, 0.1, 0.001, -0.002, 0.03]}
)";

constexpr const char* kOpenCv = R"(%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 610.5, 0., 318.25, 0., 402.125, 241.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.25, 0.1, 0.001, -0.002, 0.03 ]
)";

constexpr const char* kOpenCvXml = R"(<?xml version="1.0"?>
<opencv_storage>
<image_size>640 480</image_size>
<K type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
  <data>610.5 0. 318.25 0. 402.125 241.5 0. 0. 1.</data></K>
<D type_id="opencv-matrix"><rows>1</rows><cols>5</cols><dt>d</dt>
  <data>-0.25 0.1 0.001 -0.002 0.03</data></D>
</opencv_storage>
)";

class LoadCamera : public ::testing::Test {
 protected:
  KnownCamera load(const std::string& text) const {
    testing::write_bytes(directory_ / "camera.yaml", text);
    return load_camera(directory_ / "camera.yaml");
  }

  // The message of the refusal.
  std::string refusal(const std::string& text) const {
    SCOPED_TRACE(text);
    const Error error = testing::error_of([&] { load(text); });
    EXPECT_EQ(ErrorKind::kBadFile, error.kind());
    return error.what();
  }

  testing::ScratchDirectory directory_;
};

void expect_the_camera(const CameraModel& camera) {
  EXPECT_EQ(640, camera.width());
  EXPECT_EQ(480, camera.height());
  EXPECT_EQ(LensModel::kPlumbBob, camera.lens());
  const Eigen::VectorXd expected =
      (Eigen::VectorXd(9) << 610.5, 402.125, 318.25, 241.5, -0.25, 0.1, 0.001, -0.002, 0.03)
          .finished();
  EXPECT_EQ(expected, camera.parameters());
}

TEST_F(LoadCamera, ReadsRosWithPixelsThatAreNotSquare) {
  const KnownCamera known = load(kRos);
  expect_the_camera(known.camera);
  EXPECT_FALSE(known.covariance.has_value());
}

TEST_F(LoadCamera, ReadsOpenCvYaml) { expect_the_camera(load(kOpenCv).camera); }

TEST_F(LoadCamera, ReadsOpenCvXmlUnderOtherNames) { expect_the_camera(load(kOpenCvXml).camera); }

TEST_F(LoadCamera, ReadsAModelWithItsCovariance) {
  StriperModel model = testing::typical_model();
  std::vector<std::string> names = covariance_names(model.camera, 1);
  const auto size = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  matrix.topLeftCorner(9, 9) = 0.25 * Eigen::MatrixXd::Identity(9, 9);
  model.covariance = ModelCovariance{std::move(names), matrix};
  save_model(model, directory_ / "camera.yaml");
  const KnownCamera known = load_camera(directory_ / "camera.yaml");
  EXPECT_EQ(model.camera.parameters(), known.camera.parameters());
  ASSERT_TRUE(known.covariance.has_value());
  EXPECT_EQ(Eigen::MatrixXd(0.25 * Eigen::MatrixXd::Identity(9, 9)), *known.covariance);
}

TEST_F(LoadCamera, ReadsBackWhatIsWrittenForRos) {
  for (const StriperModel& model : {testing::typical_model(), testing::wide_model()}) {
    save_camera_info(model.camera, "striper", directory_ / "info.yaml");
    const CameraModel back = load_camera(directory_ / "info.yaml").camera;
    EXPECT_EQ(model.camera.lens(), back.lens());
    EXPECT_EQ(model.camera.parameters(), back.parameters());
  }
}

TEST_F(LoadCamera, RefusesWhatItCannotMean) {
  const std::string ros = kRos;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = ros;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_THAT(refusal(with("610.5, 0,", "610.5, 3,")), HasSubstr("skew of 3"));
  EXPECT_THAT(refusal(with("image_width: 640", "image_width: wide")),
              HasSubstr("camera.yaml:1: image_width: 'wide' - expected a whole number"));
  EXPECT_THAT(refusal(with("402.125", "wide")),
              HasSubstr("camera.yaml:4: camera_matrix.data[4]: 'wide' - expected a finite number"));
  EXPECT_THAT(refusal("camera_matrix: &a [1]\nb: [*a, *a]\n"),
              HasSubstr("camera.yaml:2: an alias (*name)"));
  EXPECT_THAT(refusal(with("plumb_bob", "thin_prism")), HasSubstr("'thin_prism'"));
  EXPECT_THAT(refusal(with("0, 0, 1]", "0, 0]")), HasSubstr("has 8 numbers; expected 9"));
  EXPECT_THAT(refusal(with("610.5, 0,", "-610.5, 0,")), HasSubstr("camera.yaml"));
  EXPECT_THAT(refusal("a: 1\n"), HasSubstr("no camera in it"));
  EXPECT_THAT(refusal("[1, 2]\n"), HasSubstr("no camera in it"));
  EXPECT_THAT(refusal("camera_matrix: 5\nimage_width: 4\nimage_height: 4\n"),
              HasSubstr("camera.yaml:1: camera_matrix: '5' - expected a list"));
  EXPECT_THAT(refusal("a: [1\n"), HasSubstr("camera.yaml:2: not valid YAML"));
  EXPECT_THAT(refusal("%YAML:1.0\n---\nnframes: 13\n"), HasSubstr("no camera in it"));
  EXPECT_THROW(load_camera(directory_ / "absent.yaml"), Error);
}

}  // namespace
}  // namespace striper
