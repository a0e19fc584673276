// SPDX-License-Identifier: Apache-2.0
// Proves that a model file is read as it is written and written as it is read, bit for bit, with
// every optional block present or absent; that what is unknown or doubtful is warned of; and that
// saving replaces a file whole or not at all. What is refused is in malformed_model_test.cpp.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

#include "support/error_of.hpp"
#include "support/heard.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::normal;
using testing::uniform;

constexpr const char* kCameraOnly = R"(striper_model: 1
camera:
  image_width: 640
  image_height: 480
  camera_matrix: {rows: 3, cols: 3, data: [620.5, 0, 320, 0, 619.1, 238, 0, 0, 1]}
  distortion_model: plumb_bob
  distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 1e-3, -2e-3, 0]}
lasers: []
stripe: {axis: rows, channel: green-red}
)";

// A plane and a focal length that vary together.
std::string plane_and_covariance(const char* plane, const char* covariance) {
  return std::string(kCameraOnly).replace(std::string(kCameraOnly).find("lasers: []"), 10, plane) +
         "covariance: {parameters: [fx, laser0_nx, laser0_d], rows: 3, cols: 3, data: " +
         covariance + "}\n";
}

std::vector<std::string> messages_of(const testing::Heard& heard) {
  std::vector<std::string> messages;
  for (const Event& event : heard.events()) messages.push_back(event.message);
  return messages;
}

bool same_look(const StripeLook& a, const StripeLook& b) {
  const auto same_width = [](const StripeLook::WidthAt& x, const StripeLook::WidthAt& y) {
    return x.range_m == y.range_m && x.width_px == y.width_px;
  };
  const auto same_amplitude = [](const StripeLook::AmplitudeAt& x,
                                 const StripeLook::AmplitudeAt& y) {
    return x.range_m == y.range_m && x.amplitude_dn == y.amplitude_dn;
  };
  return a.width_px == b.width_px && a.colour == b.colour &&
         std::equal(a.width_at.begin(), a.width_at.end(), b.width_at.begin(), b.width_at.end(),
                    same_width) &&
         std::equal(a.amplitude_at.begin(), a.amplitude_at.end(), b.amplitude_at.begin(),
                    b.amplitude_at.end(), same_amplitude);
}

bool same_bits(const StriperModel& a, const StriperModel& b) {
  const auto same_laser = [](const Laser& x, const Laser& y) {
    const bool same_frame =
        x.moved_T_cam_scan.has_value() == y.moved_T_cam_scan.has_value() &&
        (!x.moved_T_cam_scan || x.moved_T_cam_scan->matrix() == y.moved_T_cam_scan->matrix());
    return x.plane == y.plane && x.homography == y.homography && same_frame &&
           same_look(x.look, y.look);
  };
  const bool same_covariance =
      a.covariance.has_value() == b.covariance.has_value() &&
      (!a.covariance || (a.covariance->parameters == b.covariance->parameters &&
                         a.covariance->matrix == b.covariance->matrix));
  return a.camera == b.camera &&
         std::equal(a.lasers.begin(), a.lasers.end(), b.lasers.begin(), b.lasers.end(),
                    same_laser) &&
         a.axis == b.axis && a.channel == b.channel &&
         a.difference_channel == b.difference_channel && a.noise == b.noise && same_covariance &&
         a.quality_yaml == b.quality_yaml;
}

LaserPlane random_plane() {
  return {Eigen::Vector3d(uniform(-0.3, 0.3), uniform(0.5, 1.0), uniform(-0.1, 0.3)).normalized(),
          uniform(0.1, 1.0)};
}

StripeLook random_look() {
  StripeLook look;
  if (uniform(0, 1) < 0.5) look.width_px = uniform(0.5, 5.0);
  const int widths = uniform(0, 1) < 0.5 ? 0 : 2 + static_cast<int>(uniform(0, 3));
  for (int i = 0; i < widths; ++i) {
    look.width_at.push_back({1.0 + i + uniform(0.0, 0.9), uniform(0.5, 5.0)});
  }
  const int amplitudes = uniform(0, 1) < 0.5 ? 0 : 2 + static_cast<int>(uniform(0, 3));
  for (int i = 0; i < amplitudes; ++i) {
    look.amplitude_at.push_back({1.0 + i + uniform(0.0, 0.9), uniform(10.0, 900.0)});
  }
  if (uniform(0, 1) < 0.5) {
    const double blue = uniform(0.0, 0.5);
    const double green = uniform(0.0, 0.5);
    look.colour = {blue, green, 1.0 - blue - green};
  }
  return look;
}

Laser random_laser(StripeAxis axis) {
  Laser laser{random_plane(), std::nullopt, std::nullopt};
  Eigen::Isometry3d T = standard_T_cam_scan(laser.plane, axis);
  if (uniform(0, 1) < 0.5) {
    T = T * Eigen::Translation3d(uniform(-1, 1), uniform(-1, 1), 0.0) *
        Eigen::AngleAxisd(uniform(-3, 3), Eigen::Vector3d::UnitZ());
    laser.moved_T_cam_scan = T;
  }
  if (uniform(0, 1) < 0.5) laser.homography = laser_homography(laser.plane, T) * uniform(-9, 9);
  if (uniform(0, 1) < 0.5) laser.look = random_look();
  return laser;
}

StriperModel random_model() {
  StriperModel model;
  const auto lens = static_cast<LensModel>(static_cast<int>(uniform(0, 3)));
  std::vector<double> k(static_cast<std::size_t>(distortion_count(lens)));
  for (double& c : k) c = normal(0.0, 0.01);
  model.camera = CameraModel(640, 480, uniform(500, 900), uniform(500, 900), uniform(300, 340),
                             uniform(200, 260), lens, k);
  model.axis = uniform(0, 1) < 0.5 ? StripeAxis::kColumns : StripeAxis::kRows;
  model.channel = static_cast<Channel>(static_cast<int>(uniform(0, 7)));
  if (uniform(0, 1) < 0.3) model.difference_channel = Channel::kGrey;
  const int lasers = static_cast<int>(uniform(0, 4));
  for (int i = 0; i < lasers; ++i) model.lasers.push_back(random_laser(model.axis));
  if (uniform(0, 1) < 0.5) model.noise = NoiseModel{uniform(0, 3), uniform(0, 1), uniform(0, 20)};
  if (model.noise && uniform(0, 1) < 0.5) model.noise->bit_depth = 12;
  if (uniform(0, 1) < 0.5) {
    ModelCovariance covariance;
    for (const auto name : model.camera.parameter_names()) covariance.parameters.emplace_back(name);
    const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
    const Eigen::MatrixXd A =
        Eigen::MatrixXd::NullaryExpr(size, size, [] { return normal(0.0, 1e-3); });
    covariance.matrix = A * A.transpose();
    model.covariance = covariance;
  }
  if (uniform(0, 1) < 0.5) model.quality_yaml = "# as measured\nrms_px: 0.1142\nviews: [1, 2]\n";
  return model;
}

TEST(ParseModel, ReadsEveryField) {
  const StriperModel model = parse_model(kCameraOnly, "camera.yaml");
  EXPECT_EQ(model.camera, CameraModel(640, 480, 620.5, 619.1, 320.0, 238.0, LensModel::kPlumbBob,
                                      {0.1, -0.2, 1e-3, -2e-3, 0.0}));
  EXPECT_THAT(model.lasers, IsEmpty());
  EXPECT_EQ(model.axis, StripeAxis::kRows);
  EXPECT_EQ(model.channel, Channel::kGreenMinusRed);
  EXPECT_FALSE(model.noise || model.covariance);
  EXPECT_EQ(model.quality_yaml, "");
}

TEST(ParseModel, ReadsTheLooksOfTheLasers) {
  std::string text = kCameraOnly;
  text.replace(text.find("lasers: []"), std::string::npos,
               "lasers:\n"
               "  - {normal: [0, 1, 0], distance_m: 0.4}\n"
               "  - {normal: [0, 0.8, 0.6], distance_m: 0.4}\n"
               "  - {normal: [0, 0.6, 0.8], distance_m: 0.4}\n"
               "stripe:\n"
               "  axis: columns\n"
               "  channel: green\n"
               "  difference_channel: grey\n"
               "  lasers:\n"
               "    - {}\n"
               "    - {width_px: 1.5, width_at: [[1, 1.75], [2, 1.25]], "
               "amplitude_at: [[1, 150], [3, 50]], colour: [0.125, 0.75, 0.125]}\n");
  const StriperModel model = parse_model(text, "m.yaml");
  EXPECT_EQ(model.channel, Channel::kGreen);
  EXPECT_EQ(model.difference_channel, Channel::kGrey);
  EXPECT_TRUE(same_look(model.lasers[0].look, {}));
  EXPECT_TRUE(same_look(model.lasers[2].look, {}));
  EXPECT_TRUE(same_look(model.lasers[1].look, {1.5,
                                               {{1.0, 1.75}, {2.0, 1.25}},
                                               {{1.0, 150.0}, {3.0, 50.0}},
                                               std::array<double, 3>{0.125, 0.75, 0.125}}));
}

TEST(ParseModel, WarnsOfAMisspeltKeyOfALook) {
  std::string text = kCameraOnly;
  text.replace(text.find("lasers: []"), std::string::npos,
               "lasers: [{normal: [0, 1, 0], distance_m: 0.4}]\n"
               "stripe: {axis: columns, channel: grey, lasers: [{width: 1.5}]}\n");
  const testing::Heard heard;
  parse_model(text, "m.yaml", heard.port());
  EXPECT_THAT(messages_of(heard),
              ElementsAre("m.yaml:9: unknown key 'stripe.lasers[0].width' is ignored; did you mean "
                          "'width_px'?"));
}

TEST(StriperModel, RefusesALookThatCannotBe) {
  StriperModel model = parse_model(kCameraOnly, "m.yaml");
  model.lasers.push_back({LaserPlane({1.0, 0.0, 0.0}, 0.4), std::nullopt, std::nullopt});
  model.validate();
  model.lasers[0].look.width_px = -1.0;
  EXPECT_EQ(testing::error_of([&] { model.validate(); }).what(),
            std::string("model: stripe.lasers[0].width_px: -1 - expected a number of pixels above "
                        "0"));
}

TEST(ParseModel, TakesZeroForTheBlackLevelThatIsNotThere) {
  const StriperModel model = parse_model(
      std::string(kCameraOnly) + "noise: {read_noise_dn: 2, dn_per_electron: 0}\n", "m.yaml");
  EXPECT_EQ(model.noise, (NoiseModel{2.0, 0.0, 0.0}));
}

TEST(ParseModel, TurnsANegativeDistance) {
  std::string text = kCameraOnly;
  text.replace(text.find("lasers: []"), 10, "lasers: [{normal: [1, 0, 0], distance_m: -0.3}]");
  const StriperModel model = parse_model(text, "m.yaml");
  ASSERT_EQ(model.lasers.size(), 1U);
  EXPECT_EQ(model.lasers[0].plane.normal(), Eigen::Vector3d(-1.0, 0.0, 0.0));
  EXPECT_EQ(model.lasers[0].plane.distance_m(), 0.3);
}

TEST(FormatModel, ReadsBackBitForBit) {
  for (int i = 0; i < 300; ++i) {
    const StriperModel model = random_model();
    const std::string text = format_model(model);
    const testing::Heard heard;
    const StriperModel back = parse_model(text, "model.yaml", heard.port());
    EXPECT_TRUE(same_bits(model, back)) << text;
    EXPECT_THAT(messages_of(heard), IsEmpty());
    EXPECT_EQ(format_model(back), text);
  }
}

TEST(FormatModel, KeepsTheQualityBlockWithItsComments) {
  const std::string block =
      "# measured on a Friday\nrms_px: 0.11  # of 14 views\n\nnested:\n  - {a: \"1\"}\n"
      "text: |\n  two\n  lines\n";
  std::string indented;
  std::istringstream lines(block);
  for (std::string line; std::getline(lines, line);) indented += "   " + line + "\n";
  const StriperModel model =
      parse_model(std::string(kCameraOnly) + "quality:\n" + indented + "\n\n", "m.yaml");
  EXPECT_EQ(model.quality_yaml, block);
  EXPECT_EQ(parse_model(format_model(model), "m.yaml").quality_yaml, block);
}

TEST(FormatModel, KeepsAQualityBlockInFlowStyle) {
  const StriperModel model =
      parse_model("quality: {rms_px: 0.5}  # good\n" + std::string(kCameraOnly), "m.yaml");
  EXPECT_EQ(model.quality_yaml, "{rms_px: 0.5}  # good\n");
}

TEST(ParseModel, WarnsOfUnknownKeysNamingTheNearest) {
  const testing::Heard heard;
  parse_model(std::string(kCameraOnly) + "qualty: {a: 1}\nnosie: 3\nunrelated_thing: 0\n", "m.yaml",
              heard.port());
  EXPECT_THAT(messages_of(heard),
              ElementsAre("m.yaml:10: unknown key 'qualty' is ignored; did you mean 'quality'?",
                          "m.yaml:11: unknown key 'nosie' is ignored; did you mean 'noise'?",
                          "m.yaml:12: unknown key 'unrelated_thing' is ignored"));
}

TEST(ParseModel, WarnsOfALensThatFoldsInsideTheImage) {
  std::string text = kCameraOnly;
  text.replace(text.find("[0.1, -0.2"), 10, "[-0.9, 0.0");
  const testing::Heard heard;
  parse_model(text, "m.yaml", heard.port());
  ASSERT_EQ(messages_of(heard).size(), 1U);
  EXPECT_THAT(messages_of(heard)[0],
              HasSubstr("m.yaml:3: the distortion folds back inside the image: it is one-to-one "
                        "only up to 3"));
}

TEST(ParseModel, WarnsOfAPlaneThatNoPixelSees) {
  const std::string text = kCameraOnly;
  const auto with_plane = [&](const char* normal) {
    return std::string(text).replace(
        text.find("lasers: []"), 10,
        fmt::format("lasers: [{{normal: {}, distance_m: 0.5}}]", normal));
  };
  const testing::Heard heard;
  parse_model(with_plane("[1, 0, 0]"), "m.yaml",
              heard.port());  // Beside the camera: half the image sees it.
  parse_model(with_plane("[0.8, 0, 0.6]"), "m.yaml", heard.port());
  EXPECT_THAT(messages_of(heard), IsEmpty());
  parse_model(with_plane("[0.6, 0, -0.8]"), "m.yaml",
              heard.port());  // Behind it, within 53 degrees.
  ASSERT_EQ(messages_of(heard).size(), 1U);
  EXPECT_THAT(messages_of(heard)[0],
              HasSubstr("m.yaml:8: lasers[0]: no pixel sees this plane in front of the camera"));
}

class ModelFile : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() /
                 ("striper_model_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(directory_);
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(directory_),
                                                  std::filesystem::directory_iterator()));
  }

  std::filesystem::path directory_;
};

TEST_F(ModelFile, LoadsWhatWasSaved) {
  const StriperModel model = random_model();
  const auto path = directory_ / "striper.yaml";
  save_model(model, path);
  EXPECT_TRUE(same_bits(load_model(path), model));
  save_model(model, path);
  EXPECT_EQ(files(), 1U) << "no temporary file stays behind";
}

TEST_F(ModelFile, KeepsTheOldFileWhereTheModelIsNotValid) {
  const auto path = directory_ / "striper.yaml";
  save_model(random_model(), path);
  const auto before = std::filesystem::file_size(path);
  StriperModel bad = random_model();
  bad.noise = NoiseModel{-1.0, 0.0, 0.0};
  EXPECT_THROW(save_model(bad, path), Error);
  EXPECT_EQ(std::filesystem::file_size(path), before);
  EXPECT_EQ(files(), 1U);
}

TEST_F(ModelFile, SaysWhatCannotBeReadOrWritten) {
  const auto missing = directory_ / "none" / "striper.yaml";
  const Error unread = testing::error_of([&] { load_model(missing); });
  EXPECT_EQ(unread.kind(), ErrorKind::kNotFound);
  EXPECT_EQ(unread.what(), missing.string() + ": there is no such file - expected a striper model");
  const Error unwritten = testing::error_of([&] { save_model(random_model(), missing); });
  EXPECT_EQ(unwritten.kind(), ErrorKind::kIo);
  EXPECT_EQ(unwritten.what(), missing.string() + ": cannot be written: No such file or directory");
  EXPECT_THROW(load_model(directory_), Error);
  EXPECT_THROW(save_model(random_model(), directory_), Error);
  EXPECT_THROW(load_model("/dev/zero"), Error);
}

TEST(StriperModel, GivesTheStandingOrTheMovedFrame) {
  StriperModel model;
  model.lasers.push_back({LaserPlane({0.0, 1.0, 0.0}, 0.4), std::nullopt, std::nullopt});
  EXPECT_EQ(model.T_cam_scan(0).matrix(),
            standard_T_cam_scan(model.lasers[0].plane, StripeAxis::kColumns).matrix());
  model.lasers[0].moved_T_cam_scan = model.T_cam_scan(0) * Eigen::Translation3d(0.1, 0.0, 0.0);
  EXPECT_EQ(model.T_cam_scan(0).matrix(), model.lasers[0].moved_T_cam_scan->matrix());
  EXPECT_THROW(model.T_cam_scan(1), Error);
  EXPECT_THROW(model.T_cam_scan(-1), Error);
}

TEST(ModelYaml, PlaneGivenTheOtherWayRoundTurnsItsCovariancesToo) {
  const StriperModel model =
      parse_model(plane_and_covariance("lasers:\n  - {normal: [0.6, 0.8, 0], distance_m: 0.5}",
                                       "[4, 1e-3, 2e-3, 1e-3, 1e-6, 1e-7, 2e-3, 1e-7, 4e-6]"),
                  "a");
  const StriperModel turned =
      parse_model(plane_and_covariance("lasers:\n  - {normal: [-0.6, -0.8, 0], distance_m: -0.5}",
                                       "[4, -1e-3, -2e-3, -1e-3, 1e-6, 1e-7, -2e-3, 1e-7, 4e-6]"),
                  "b");
  EXPECT_EQ(format_model(turned), format_model(model));
}

}  // namespace
}  // namespace striper
