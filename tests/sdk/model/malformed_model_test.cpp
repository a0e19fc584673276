// SPDX-License-Identifier: Apache-2.0
// Proves that every way we know to get a model file wrong is refused with the exact message that
// names file, line, field, value and what was expected, and that no damage to a file (cut off
// anywhere, bytes changed at random) does anything but be refused or still be a valid model. It
// does not prove that the messages help; a person wrote each file of `malformed/` and read its
// message.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::uniform;

struct Malformed {
  const char* file;     ///< Of `malformed/`, without `.yaml`.
  const char* message;  ///< What follows the name of the file.
};

void PrintTo(const Malformed& malformed, std::ostream* out) { *out << malformed.file; }

// clang-format off
constexpr Malformed kZoo[] = {
    {"T_cam_scan_3x4", ":11: lasers[0].T_cam_scan.rows: '3' - expected 4"},
    {"T_cam_scan_last_row", ":11: lasers[0].T_cam_scan: a matrix with another last row - expected [0, 0, 0, 1] as the last row"},
    {"T_cam_scan_left_handed", ":11: lasers[0].T_cam_scan: a left-handed frame - expected a right-handed one"},
    {"T_cam_scan_not_a_rotation", ":11: lasers[0].T_cam_scan: off a rotation by 3 - expected a right-handed rotation to 1e-06"},
    {"T_cam_scan_off_the_plane", ":11: lasers[0].T_cam_scan: its origin is 0.1 m off the laser plane - expected at most 1e-06: the x-y plane of the frame is the laser plane"},
    {"T_cam_scan_tilted", ":11: lasers[0].T_cam_scan: its z axis is 0.01 rad off the laser plane's normal - expected at most 1e-06: the x-y plane of the frame is the laser plane"},
    {"a_sentence", ":1: the file: 'This is not a model.' - expected a map with striper_model, camera, lasers, stripe, noise, covariance, quality"},
    {"alias", ":4: an alias (*name) - expected every value written out"},
    {"alias_bomb", ":2: an alias (*name) - expected every value written out"},
    {"axis_is_a_list", ":11: stripe.axis: a list of 2 - expected columns or rows"},
    {"axis_unknown", ":11: stripe.axis: 'diagonal' - expected columns or rows"},
    {"bad_indentation", ":4: not valid YAML: illegal map value"},
    {"binary", ":3: not valid YAML: unknown escape character: "},
    {"bit_depth_32", ":12: noise.bit_depth: '32' - expected a whole number from 8 to 16"},
    {"black_level_nan", ":12: noise.black_level_dn: '.nan' - expected a finite number"},
    {"camera_is_a_word", ":2: camera: 'good' - expected a map with image_width, image_height, camera_matrix, distortion_model, distortion_coefficients"},
    {"camera_is_empty", ":3: camera: empty - expected a map with image_width, image_height, camera_matrix, distortion_model, distortion_coefficients"},
    {"camera_matrix_3x4", ":5: camera.camera_matrix.cols: '4' - expected 3"},
    {"camera_matrix_8_numbers", ":5: camera.camera_matrix.data: a list of 8 - expected a list of 9"},
    {"camera_matrix_all_zero", ":5: camera.camera_matrix.data[0]: '0' - expected a focal length in pixels, above 0"},
    {"camera_matrix_comma", ":5: camera.camera_matrix.data[0]: '620,5' in quotes - expected a finite number"},
    {"camera_matrix_inf", ":5: camera.camera_matrix.data[2]: '.inf' - expected a finite number"},
    {"camera_matrix_is_a_bare_list", ":5: camera.camera_matrix: a list of 9 - expected a map with rows, cols, data"},
    {"camera_matrix_nan", ":5: camera.camera_matrix.data[0]: '.nan' - expected a finite number"},
    {"camera_matrix_overflow", ":5: camera.camera_matrix.data[0]: '1e999' - expected a finite number"},
    {"camera_matrix_skew", ":5: camera.camera_matrix.data[1]: '0.5' - expected 0: the matrix is [fx, 0, cx, 0, fy, cy, 0, 0, 1]"},
    {"camera_matrix_transposed", ":5: camera.camera_matrix.data[6]: '320' - expected 0: the matrix is [fx, 0, cx, 0, fy, cy, 0, 0, 1]"},
    {"camera_matrix_without_data", ":5: camera.camera_matrix.data is missing - expected a list of 9"},
    {"camera_matrix_word", ":5: camera.camera_matrix.data[1]: 'zero' - expected a finite number"},
    {"channel_unknown", ":11: stripe.channel: 'infrared' - expected auto, grey, red, green, blue, green-red or red-green"},
    {"covariance_correlation_above_1", ":17: covariance.data: covariance of fx and laser0_d is 0.003 - expected at most 0.002, the geometric mean of their variances"},
    {"covariance_name_is_a_list", ":14: covariance.parameters[1]: a list of 1 - expected the name of a parameter"},
    {"covariance_name_of_another_lens", ":14: covariance.parameters[1]: 'k4' - expected one of fx, fy, cx, cy, k1, k2, p1, p2, k3, laser0_nx, laser0_ny, laser0_nz, laser0_d"},
    {"covariance_name_twice", ":14: covariance.parameters[1]: 'fx' - expected each parameter once"},
    {"covariance_name_unknown", ":14: covariance.parameters[1]: 'laser1_d' - expected one of fx, fy, cx, cy, k1, k2, p1, p2, k3, laser0_nx, laser0_ny, laser0_nz, laser0_d"},
    {"covariance_nan", ":17: covariance.data[3]: 'nan' - expected a finite number"},
    {"covariance_negative_variance", ":17: covariance.data: variance of fx is -4 - expected a finite number, 0 or more"},
    {"covariance_not_positive", ":17: covariance.data: smallest eigenvalue of the correlations -0.8 - expected 0 or more: a covariance is positive semi-definite"},
    {"covariance_not_symmetric", ":17: covariance.data: covariance of fx and laser0_d is 0.001 above the diagonal and 0.0005 below - expected a symmetric matrix"},
    {"covariance_rows_disagree", ":15: covariance.rows: '3' - expected 2"},
    {"covariance_three_numbers", ":17: covariance.data: a list of 3 - expected a list of 4"},
    {"covariance_too_many_names", ":14: covariance.parameters: a list of 300 - expected at most 268"},
    {"deeply_nested", ":1: lists or maps nested 33 deep - expected at most 32"},
    {"difference_channel_unknown", ":11: stripe.difference_channel: 'dark' - expected auto, grey, red, green, blue, green-red or red-green"},
    {"distance_inf", ":10: lasers[0].distance_m: 'inf' - expected a finite number of metres"},
    {"distance_with_unit", ":10: lasers[0].distance_m: '0.4 m' - expected a finite number of metres"},
    {"distance_zero", ":10: lasers[0].distance_m: 0 - expected more than 0: from a plane through the camera's centre follows no range"},
    {"distortion_cols_disagree", ":7: camera.distortion_coefficients.data: a list of 4 - expected a list of 5"},
    {"distortion_five_of_equidistant", ":7: camera.distortion_coefficients.cols: '5' - expected 4: the coefficients of equidistant"},
    {"distortion_four_of_plumb_bob", ":7: camera.distortion_coefficients.cols: '4' - expected 5: the coefficients of plumb_bob"},
    {"distortion_huge", ":3: camera: distortion coefficient k2 is -2000000000 - expected a finite number of magnitude up to 1000000000"},
    {"distortion_model_is_a_map", ":6: camera.distortion_model: a map of 1 - expected plumb_bob, rational_polynomial or equidistant"},
    {"distortion_model_unknown", ":6: camera.distortion_model: 'fisheye' - expected plumb_bob, rational_polynomial or equidistant"},
    {"distortion_nan", ":7: camera.distortion_coefficients.data[1]: 'nan' - expected a finite number"},
    {"duplicate_key", ":5: camera: key 'image_width' a second time - expected each key once"},
    {"empty", ": the file: empty - expected a map with striper_model, camera, lasers, stripe, noise, covariance, quality"},
    {"focal_length_negative", ":5: camera.camera_matrix.data[4]: '-619' - expected a focal length in pixels, above 0"},
    {"focal_length_zero", ":5: camera.camera_matrix.data[0]: '0' - expected a focal length in pixels, above 0"},
    {"homography_2x3", ":11: lasers[0].homography.rows: '2' - expected 3"},
    {"homography_disagrees", ":11: lasers[0].homography: off by 0.00813 from the one of the plane - expected the homography of normal, distance_m and scan frame, up to scale to 1e-06; leave it out and it is computed"},
    {"homography_nan", ":11: lasers[0].homography.data[2]: '.nan' - expected a finite number"},
    {"homography_zero", ":11: lasers[0].homography: all zero - expected a non-zero matrix"},
    {"image_height_is_a_list", ":4: camera.image_height: a list of 1 - expected a whole number from 1 to 100000"},
    {"image_height_is_null", ":4: camera.image_height: empty - expected a whole number from 1 to 100000"},
    {"image_width_fraction", ":3: camera.image_width: '640.5' - expected a whole number from 1 to 100000"},
    {"image_width_huge", ":3: camera.image_width: '99999999999999999999' - expected a whole number from 1 to 100000"},
    {"image_width_in_quotes", ":3: camera.image_width: '640' in quotes - expected a whole number from 1 to 100000"},
    {"image_width_misspelt", ":3: camera.image_width is missing (is 'image_widht' meant to be it?) - expected a number of pixels"},
    {"image_width_negative", ":3: camera.image_width: '-640' - expected a whole number from 1 to 100000"},
    {"image_width_with_unit", ":3: camera.image_width: '640 px' - expected a whole number from 1 to 100000"},
    {"image_width_zero", ":3: camera.image_width: '0' - expected a whole number from 1 to 100000"},
    {"laser_is_a_list", ":9: lasers[0]: a list of 4 - expected a map with normal, distance_m, homography, T_cam_scan"},
    {"lasers_is_a_map", ":9: lasers: a map of 2 - expected a list"},
    {"lasers_is_empty", ":9: lasers: empty - expected a list"},
    {"list_as_key", ":11: the file: a list of 2 - expected a word as key"},
    {"look_amplitude_at_falling", ":11: stripe.lasers[0].amplitude_at[1]: range 1 after 2 - expected ranges that rise"},
    {"look_amplitude_at_inf", ":11: stripe.lasers[0].amplitude_at[0][1]: '.inf' - expected a finite number"},
    {"look_amplitude_at_once", ":11: stripe.lasers[0].amplitude_at: one pair - expected a course over range: none, or two pairs and more"},
    {"look_amplitude_at_zero", ":11: stripe.lasers[0].amplitude_at[1]: [2, 0] - expected a range in metres and an amplitude in DN, both above 0"},
    {"look_colour_in_percent", ":11: stripe.lasers[0].colour: [10, 80, 10] - expected shares of blue, green and red, each 0 or more, whose sum is 1"},
    {"look_colour_is_a_word", ":11: stripe.lasers[0].colour: 'red' - expected a list of 3"},
    {"look_colour_negative", ":11: stripe.lasers[0].colour: [-0.1, 0.9, 0.2] - expected shares of blue, green and red, each 0 or more, whose sum is 1"},
    {"look_colour_of_four", ":11: stripe.lasers[0].colour: a list of 4 - expected a list of 3"},
    {"look_is_a_number", ":11: stripe.lasers[0]: '1.4' - expected a map with width_px, width_at, amplitude_at, colour"},
    {"look_is_empty", ":11: stripe.lasers[0]: empty - expected a map with width_px, width_at, amplitude_at, colour"},
    {"look_width_at_falling", ":11: stripe.lasers[0].width_at[1]: range 1 after 2 - expected ranges that rise"},
    {"look_width_at_is_a_pair", ":11: stripe.lasers[0].width_at[0]: '1' - expected a list of 2"},
    {"look_width_at_negative", ":11: stripe.lasers[0].width_at[1]: [2, -1.3] - expected a range in metres and a width in pixels, both above 0"},
    {"look_width_at_of_three", ":11: stripe.lasers[0].width_at[0]: a list of 3 - expected a list of 2"},
    {"look_width_at_once", ":11: stripe.lasers[0].width_at: one pair - expected a course over range: none, or two pairs and more"},
    {"look_width_at_range_zero", ":11: stripe.lasers[0].width_at[0]: [0, 1.4] - expected a range in metres and a width in pixels, both above 0"},
    {"look_width_at_twice_the_same", ":11: stripe.lasers[0].width_at[2]: range 2 after 2 - expected ranges that rise"},
    {"look_width_nan", ":11: stripe.lasers[0].width_px: '.nan' - expected a finite number"},
    {"look_width_with_unit", ":11: stripe.lasers[0].width_px: '1.4 px' - expected a finite number"},
    {"look_width_zero", ":11: stripe.lasers[0].width_px: 0 - expected a number of pixels above 0"},
    {"looks_are_a_map", ":11: stripe.lasers: a map of 1 - expected a list"},
    {"looks_of_more_lasers", ":11: stripe.lasers: a list of 2 - expected at most 1, as there are lasers"},
    {"no_axis", ":11: stripe.axis is missing - expected columns or rows"},
    {"no_camera", ":1: camera is missing - expected a map"},
    {"no_channel", ":11: stripe.channel is missing - expected auto, grey, red, green, blue, green-red or red-green"},
    {"no_covariance_parameters", ":14: covariance.parameters is missing - expected a list of names"},
    {"no_distance", ":9: lasers[0].distance_m is missing - expected a number of metres"},
    {"no_distortion_coefficients", ":3: camera.distortion_coefficients is missing - expected {rows, cols, data}"},
    {"no_distortion_model", ":3: camera.distortion_model is missing - expected plumb_bob, rational_polynomial or equidistant"},
    {"no_dn_per_electron", ":12: noise.dn_per_electron is missing - expected a number"},
    {"no_image_width", ":3: camera.image_width is missing - expected a number of pixels"},
    {"no_lasers", ":1: lasers is missing - expected a list, [] for a camera alone"},
    {"no_normal", ":9: lasers[0].normal is missing - expected [nx, ny, nz]"},
    {"no_read_noise", ":12: noise.read_noise_dn is missing - expected a number"},
    {"no_stripe", ":1: stripe is missing - expected a map with axis, channel"},
    {"no_version", ":1: striper_model is missing - expected the version of the format, 1"},
    {"noise_is_a_number", ":12: noise: '3' - expected a map with read_noise_dn, dn_per_electron, black_level_dn, bit_depth"},
    {"normal_along_the_axis", ":9: lasers[0].normal: [0, 0, 1], along the optical axis - expected a plane that the camera looks along, so that its scan frame has an x axis"},
    {"normal_is_a_number", ":9: lasers[0].normal: '1' - expected a list of 3"},
    {"normal_nan", ":9: lasers[0].normal[1]: '.NaN' - expected a finite number"},
    {"normal_not_unit", ":9: lasers[0].normal: [0, 1.001, 0], of length 1.001 - expected length 1 to 1e-06; divided by it, normal: [0, 1, 0] and distance_m: 0.3996003996"},
    {"normal_of_the_other_axis", ":9: lasers[0].normal: [1, 0, 0], without a component along y - expected a plane across the search direction of stripe axis columns; is it the other axis?"},
    {"normal_of_two", ":9: lasers[0].normal: a list of 2 - expected a list of 3"},
    {"normal_zero", ":9: lasers[0].normal: [0, 0, 0], of length 0 - expected length 1 to 1e-06"},
    {"not_a_map", ":1: the file: a list of 2 - expected a map with striper_model, camera, lasers, stripe, noise, covariance, quality"},
    {"only_a_comment", ": the file: empty - expected a map with striper_model, camera, lasers, stripe, noise, covariance, quality"},
    {"quality_is_a_list", ":19: quality: a list of 1 - expected a map"},
    {"quality_is_a_number", ":18: quality: '0.1' - expected a map"},
    {"read_noise_negative", ":12: noise.read_noise_dn: -1.5 - expected a finite number, 0 or more"},
    {"recursive_alias", ":1: an alias (*name) - expected every value written out"},
    {"stripe_is_a_word", ":11: stripe: 'columns' - expected a map with axis, channel, difference_channel, lasers"},
    {"tab_indentation", ":4: not valid YAML: illegal tab when looking for indentation"},
    {"two_documents", ":19: a second document (---) - expected one"},
    {"unclosed_bracket", ":6: not valid YAML: end of sequence flow not found"},
    {"version_2", ":1: striper_model: '2' - expected 1: the version of the format that this program reads"},
    {"version_fraction", ":1: striper_model: '1.0' - expected 1: the version of the format that this program reads"},
    {"version_word", ":1: striper_model: 'one' - expected 1: the version of the format that this program reads"},
};
// clang-format on

std::filesystem::path zoo_path() { return testing::source_path("tests/sdk/model/malformed"); }

std::string read(const std::filesystem::path& path) {
  const std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class MalformedModel : public ::testing::TestWithParam<Malformed> {};

INSTANTIATE_TEST_SUITE_P(Zoo, MalformedModel, ::testing::ValuesIn(kZoo),
                         [](const auto& instance) { return std::string(instance.param.file); });

TEST_P(MalformedModel, IsRefusedWithItsExactMessage) {
  const std::string name = std::string(GetParam().file) + ".yaml";
  const auto path = zoo_path() / name;
  ASSERT_TRUE(std::filesystem::exists(path));
  const Error error = testing::error_of([&] { parse_model(read(path), name); });
  EXPECT_EQ(error.what(), name + GetParam().message);
  EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
}

TEST(MalformedModelZoo, TableHasEveryFile) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(zoo_path())) {
    files.insert(entry.path().stem().string());
  }
  std::set<std::string> table;
  for (const Malformed& malformed : kZoo) table.insert(malformed.file);
  EXPECT_EQ(files, table);
}

StriperModel full_model() {
  StriperModel model;
  model.camera = CameraModel(640, 480, 620.5, 619.25, 320.125, 238.0, LensModel::kPlumbBob,
                             {0.1, -0.2, 1e-3, -2e-3, 0.05});
  Laser laser{LaserPlane({0.0, 0.8, 0.6}, 0.4), std::nullopt, std::nullopt};
  laser.moved_T_cam_scan = standard_T_cam_scan(laser.plane, StripeAxis::kColumns);
  laser.homography = laser_homography(laser.plane, *laser.moved_T_cam_scan);
  model.lasers = {laser, {LaserPlane({0.0, 1.0, 0.0}, 0.5), std::nullopt, std::nullopt}};
  model.lasers[0].look = {1.5, {{1.0, 1.75}, {2.5, 1.25}}, {{1.0, 150.0}, {2.5, 50.0}}, {}};
  model.lasers[1].look.colour = {0.125, 0.75, 0.125};
  model.difference_channel = Channel::kGrey;
  model.noise = NoiseModel{1.5, 0.1, 16.0};
  model.covariance = ModelCovariance{{"fx", "laser1_d"}, Eigen::Vector2d(4.0, 1e-6).asDiagonal()};
  model.quality_yaml = "rms_px: 0.1\nviews: [1, 2, 3]\nnotes: {a: \"quoted\"}\n";
  return model;
}

// Whatever is accepted must be a model that can be saved and read back.
bool is_refused(const std::string& text) {
  StriperModel model;
  try {
    model = parse_model(text, "damaged.yaml");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile) << text;
    return true;
  }
  const std::string formatted = format_model(model);
  EXPECT_EQ(format_model(parse_model(formatted, "formatted.yaml")), formatted) << text;
  return false;
}

TEST(DamagedModel, CutOffAnywhereIsRefusedOrValid) {
  const std::string text = format_model(full_model());
  ASSERT_FALSE(is_refused(text));
  int refused = 0;
  for (std::size_t size = 0; size < text.size(); ++size) {
    refused += is_refused(text.substr(0, size)) ? 1 : 0;
  }
  // What follows the stripe block is optional.
  EXPECT_GE(static_cast<std::size_t>(refused), text.find("\nstripe:"));
}

TEST(DamagedModel, ChangedBytesAreRefusedOrValid) {
  const std::string text = format_model(full_model());
  constexpr std::string_view kTelling = "0123456789.-+eE:,[]{}#&*!|>'\"%@`~?\n\t\r \\";
  int refused = 0;
  constexpr int kRounds = 2000;
  for (int round = 0; round < kRounds; ++round) {
    std::string damaged = text;
    const int changes = static_cast<int>(uniform(1, 5));
    for (int i = 0; i < changes; ++i) {
      const auto at = static_cast<std::size_t>(uniform(0.0, static_cast<double>(damaged.size())));
      const double kind = uniform(0.0, 1.0);
      if (kind < 0.4) {
        damaged[at] = static_cast<char>(static_cast<unsigned char>(uniform(0.0, 256.0)));
      } else if (kind < 0.8) {
        damaged[at] =
            kTelling[static_cast<std::size_t>(uniform(0.0, static_cast<double>(kTelling.size())))];
      } else {
        damaged.erase(at, static_cast<std::size_t>(uniform(1.0, 30.0)));
      }
    }
    refused += is_refused(damaged) ? 1 : 0;
  }
  EXPECT_GT(refused, kRounds / 4);
  EXPECT_LT(refused, kRounds);
}

}  // namespace
}  // namespace striper
